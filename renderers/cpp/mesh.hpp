#pragma once
#include "bounds.hpp"
#include "ray.hpp"

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
    Real vertex[3][3];
    Vec3<Real> normal;
    Real size = 0;
    bool closed;  // the mesh: its normals point outward

    // What the ray's line has to do with the triangle, in the sheared frame.
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
            u = x[2] * y[1] - y[2] * x[1];
            v = x[0] * y[2] - y[0] * x[2];
            w = x[1] * y[0] - y[1] * x[0];
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
        normal = rounded<Real>(normalise(cross(corner(1) - corner(0), corner(2) - corner(0))));  // TRI-2
    }

    // TRI-1
    Real distance(const Shear<Real>& ray) const
    {
        const Sheared s(*this, ray);
        if (!((s.u >= 0 && s.v >= 0 && s.w >= 0) || (s.u <= 0 && s.v <= 0 && s.w <= 0)) || s.u + s.v + s.w == 0)
            return 0;
        return s.t(ray);
    }

    // CSG-2: does the line cross? If so, at t. Of two triangles with an edge that it meets, exactly one is crossed.
    bool crossed(const Shear<Real>& ray, Real& t) const
    {
        const Sheared s(*this, ray);
        const auto positive = [&](Real area, int from, int to) {
            const Real x = s.x[to] - s.x[from], y = s.y[to] - s.y[from];
            return area != 0 ? area > 0 : y > 0 || (y == 0 && x > 0);
        };
        const bool side = positive(s.u, 1, 2);
        if (positive(s.v, 2, 0) != side || positive(s.w, 0, 1) != side || s.u + s.v + s.w == 0)
            return false;
        t = s.t(ray);
        return true;
    }

    // TRI-2
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Vec3<Real> p = ray.origin + t * ray.direction, v0{vertex[0][0], vertex[0][1], vertex[0][2]};
        const bool turn = !closed && !(dot(ray.direction, normal) < 0);
        return {p - dot(p - v0, normal) * normal, turn ? -normal : normal, size};
    }

    Bounds<Real> bounds() const
    {
        Bounds<Real> bounds;
        for (const Real* v : vertex)
            bounds.hold(Vec3<Real>{v[0], v[1], v[2]});
        return bounds;
    }
};
