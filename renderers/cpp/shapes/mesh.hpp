#pragma once
#include "bounds.hpp"
#include "../methods.hpp"
#include "../ray.hpp"
#include "twofold.hpp"

#include <cstddef>
#include <cstdint>
#include <utility>

// TRI-1: the frame in which a ray starts at the origin and runs along z. The same for all triangles.
template<typename Real>
struct Shear {
    Real start[3];
    int kx, ky, kz;
    Real sx, sy, sz;

    explicit Shear(const Ray<Real>& ray) : start{ray.origin.x, ray.origin.y, ray.origin.z}
    {
        const Real d[3] = {ray.direction.x, ray.direction.y, ray.direction.z};
        kz = std::abs(d[1]) > std::abs(d[0]) ? 1 : 0;
        if (std::abs(d[2]) > std::abs(d[kz]))
            kz = 2;
        kx = (kz + 1) % 3, ky = (kz + 2) % 3;
        if (d[kz] < 0)
            std::swap(kx, ky);
        sx = d[kx] / d[kz], sy = d[ky] / d[kz], sz = 1 / d[kz];
    }
};

// A triangle of a mesh.
template<typename Real>
struct Triangle {
    static constexpr bool by_edges = methods::triangle == TriangleForm::moller_trumbore;
    using Line = std::conditional_t<by_edges, Ray<Real>, Shear<Real>>;

    Real vertex[3][3];
    [[no_unique_address]] Only<by_edges, std::array<Vec3<Real>, 2>, 'e'> edge;  // from the first vertex
    Vec3<Real> normal;
    Real size = 0;
    bool closed;  // the mesh: its normals point outward

    // What the ray's line has to do with the triangle, in the sheared frame.
    template<bool kahan>
    struct Sheared {
        Real x[3], y[3], z[3];
        Real u, v, w;

        Sheared(const Triangle& triangle, const Shear<Real>& ray)
        {
            for (int i = 0; i < 3; i++) {
                const Real along = triangle.vertex[i][ray.kz] - ray.start[ray.kz];
                x[i] = triangle.vertex[i][ray.kx] - ray.start[ray.kx] - ray.sx * along;
                y[i] = triangle.vertex[i][ray.ky] - ray.start[ray.ky] - ray.sy * along;
                z[i] = along;
            }
            u = area(2, 1), v = area(0, 2), w = area(1, 0);
        }

        Real area(int a, int b) const
        {
            if constexpr (kahan)
                return difference_of_products(x[a], y[b], y[a], x[b]);
            else
                return x[a] * y[b] - y[a] * x[b];
        }

        Real t(const Shear<Real>& ray) const
        {
            return (u * (ray.sz * z[0]) + v * (ray.sz * z[1]) + w * (ray.sz * z[2])) / (u + v + w);
        }
    };

    Triangle(const double* vertices, const std::int32_t* corners, bool closed) : closed(closed)
    {
        const auto corner = [&](int i) { return vec(vertices + 3 * std::ptrdiff_t(corners[i])); };
        for (int i = 0; i < 3; i++) {
            const Vec3<Real> v = rounded<Real>(corner(i));
            vertex[i][0] = v.x, vertex[i][1] = v.y, vertex[i][2] = v.z;
            size = std::max(size, largest(rounded<Real>(corner(i) - corner(0))));
        }
        if constexpr (by_edges)
            edge = {point(1) - point(0), point(2) - point(0)};
        normal = rounded<Real>(normalise(cross(corner(1) - corner(0), corner(2) - corner(0))));  // TRI-2
    }

    Vec3<Real> point(int i) const { return {vertex[i][0], vertex[i][1], vertex[i][2]}; }

    // TRI-3: by the form that the program is built with.
    Real distance(const Line& line) const
    {
        if constexpr (by_edges)
            return moller_trumbore(line);
        else
            return watertight(line);
    }

    Real moller_trumbore(const Ray<Real>& ray) const
    {
        const Vec3<Real> p = cross(ray.direction, edge[1]);
        const Real det = dot(edge[0], p);
        if (det == 0)
            return 0;
        const Vec3<Real> s = ray.origin - point(0);
        const Real u = dot(s, p) / det;
        if (!(u >= 0))
            return 0;
        const Vec3<Real> q = cross(s, edge[0]);
        const Real v = dot(ray.direction, q) / det;
        if (!(v >= 0 && u + v <= 1))
            return 0;
        return dot(edge[1], q) / det;
    }

    // TRI-1
    Real watertight(const Shear<Real>& ray) const
    {
        const Sheared<methods::triangle == TriangleForm::watertight_kahan> s(*this, ray);
        if (!((s.u >= 0 && s.v >= 0 && s.w >= 0) || (s.u <= 0 && s.v <= 0 && s.w <= 0)) || s.u + s.v + s.w == 0)
            return 0;
        return s.t(ray);
    }

    // CSG-2: does the line cross? If so, at t. Of two triangles with an edge that it meets, exactly one is crossed.
    bool crossed(const Shear<Real>& ray, Real& t) const
    {
        const Sheared<false> s(*this, ray);
        const auto positive = [&](Real area, int from, int to) {
            const Real x = s.x[to] - s.x[from], y = s.y[to] - s.y[from];
            return area != 0 ? area > 0 : y > 0 || (y == 0 && x > 0);
        };
        const bool side = positive(s.u, 1, 2);
        const bool same = positive(s.v, 2, 0) == side && positive(s.w, 0, 1) == side;
        if (!same || !(std::abs(s.u + s.v + s.w) > 0))  // NUM-5: a NaN is no crossing
            return false;
        t = s.t(ray);
        return true;
    }

    // TRI-2
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Vec3<Real> p = ray.origin + t * ray.direction;
        const bool turn = !closed && !(dot(ray.direction, normal) < 0);
        return {p - dot(p - point(0), normal) * normal, turn ? -normal : normal, size};
    }

    Bounds<Real> bounds() const
    {
        Bounds<Real> bounds;
        for (const Real* v : vertex)
            bounds.hold(Vec3<Real>{v[0], v[1], v[2]});
        return bounds;
    }
};
