// VEC-3: one ray against as many spheres or triangles as there are lanes, in the arithmetic of one after the other.
#pragma once
#include "lanes.hpp"
#include "../shapes/mesh.hpp"
#include "../shapes/sphere.hpp"

// Lanes without a shape have NaN and are missed.
template<typename Real>
struct LaneGroup {
    int numbers[lane_count<Real>];
    int size = 0;
};

template<typename Real>
struct SphereGroup : LaneGroup<Real> {
    static constexpr bool possible = methods::sphere == SphereForm::robust;

    Vec3<Lanes<Real>> centre = all(Vec3<Real>{NAN, NAN, NAN});
    Lanes<Real> radius{};

    void add(const Sphere<Real>& sphere, int number)
    {
        const int k = this->size++;
        this->numbers[k] = number;
        centre.x[k] = sphere.centre.x, centre.y[k] = sphere.centre.y, centre.z[k] = sphere.centre.z;
        radius[k] = sphere.radius;
    }

    // SPH-1 of each lane: t, or anything not greater than 0; `unsure` are lanes that must be asked by themselves.
    LANE Lanes<Real> distance(const Ray<Real>& ray, unsigned& unsure) const
    {
        const Vec3<Lanes<Real>> f = centre - all(ray.origin), d = all(ray.direction);
        const Lanes<Real> b = dot(f, d), square = radius * radius;
        const Vec3<Lanes<Real>> l = Sphere<Real>::narrow ? along<Real>(f, -b, d) : f - b * d;
        const Lanes<Real> delta = square - dot(l, l);
        unsure = 0;
        if constexpr (Sphere<Real>::narrow) {
            const Lanes<Real> slack = 4 * std::numeric_limits<Real>::epsilon() * radius * (::size<Real>(b) + radius);
            unsure = bits<Real>((delta >= -slack) & (delta < slack));
        }
        if (!any<Real>(delta >= 0))
            return Lanes<Real>{};
        const Lanes<Real> k = dot(f, f) - square, half = root<Real>(delta);
        const Mask<Real> inside = ~(k > 0), back = b < 0;
        const Lanes<Real> q = inside & back ? b - half : b + half, t = inside & ~back ? q : k / q;
        return (delta >= 0) & (inside | (b > 0)) ? t : Lanes<Real>{};
    }
};

template<typename Real>
struct TriangleGroup : LaneGroup<Real> {
    static constexpr bool possible = methods::triangle != TriangleForm::moller_trumbore;

    Lanes<Real> vertex[3][3];

    TriangleGroup() { std::fill_n(&vertex[0][0], 9, all(Real(NAN))); }

    void add(const Triangle<Real>& triangle, int number)
    {
        const int k = this->size++;
        this->numbers[k] = number;
        for (int corner = 0; corner < 3; corner++)
            for (int axis = 0; axis < 3; axis++)
                vertex[corner][axis][k] = triangle.vertex[corner][axis];
    }

    // TRI-1, TRI-3 of each lane: t, or anything not greater than 0.
    LANE Lanes<Real> distance(const Shear<Real>& ray, unsigned&) const
    {
        Lanes<Real> x[3], y[3], z[3];
        for (int i = 0; i < 3; i++) {
            z[i] = vertex[i][ray.kz] - ray.start[ray.kz];
            x[i] = vertex[i][ray.kx] - ray.start[ray.kx] - ray.sx * z[i];
            y[i] = vertex[i][ray.ky] - ray.start[ray.ky] - ray.sy * z[i];
        }
        const auto area = [&](int a, int b) -> Lanes<Real> {
            if constexpr (methods::triangle == TriangleForm::watertight_kahan) {
                const Lanes<Real> w = y[a] * x[b];
                return fma<Real>(x[a], y[b], -w) + fma<Real>(-y[a], x[b], w);
            } else
                return x[a] * y[b] - y[a] * x[b];
        };
        const Lanes<Real> u = area(2, 1), v = area(0, 2), w = area(1, 0), sum = u + v + w;
        const Mask<Real> met = (((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))) & (sum != 0);
        if (!any<Real>(met))
            return Lanes<Real>{};
        const Lanes<Real> t = (u * (ray.sz * z[0]) + v * (ray.sz * z[1]) + w * (ray.sz * z[2])) / sum;
        return met ? t : Lanes<Real>{};
    }
};
