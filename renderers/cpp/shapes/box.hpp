#pragma once
#include "bounds.hpp"
#include "../methods.hpp"
#include "../ray.hpp"

// Six sides, in pairs that are parallel: a corner and three edges at any angle.
template<typename Real>
struct Box {
    Vec3<Real> corner, edge[3];
    Vec3<Real> g[3], normal[3];  // reciprocal vectors, and the same with unit length
    Real size = 0;

    struct Side {
        int axis;
        bool high;
    };

    // What a line has in common with the box: from t0, through side `in`, to t1, through side `out`.
    struct Span {
        Real t0, t1;
        Side in, out;
    };

    explicit Box(const double* row) : corner(rounded<Real>(vec(row)))
    {
        const auto reciprocals = reciprocal(vec(row + 3), vec(row + 6), vec(row + 9));
        for (int a = 0; a < 3; a++) {
            edge[a] = rounded<Real>(vec(row + 3 + 3 * a));
            g[a] = rounded<Real>(reciprocals[a]);
            normal[a] = rounded<Real>(normalise(reciprocals[a]));
            size = std::max(size, largest(edge[a]));
        }
    }

    // BOX-1. A line that runs beside the box spans from infinity to -infinity, which is no span.
    Span span(const Ray<Real>& ray) const
    {
        constexpr Real infinity = std::numeric_limits<Real>::infinity();
        const Vec3<Real> f = ray.origin - corner;
        Span span{-infinity, infinity, {}, {}};
        for (int a = 0; a < 3; a++) {
            const Real s = dot(g[a], f), w = dot(g[a], ray.direction);
            if (w == 0) {
                if (!(s >= 0 && s <= 1))
                    return {infinity, -infinity, {}, {}};
                continue;
            }
            const bool high = w < 0;  // the side it comes in through
            const Real enter = (Real(high) - s) / w, leave = (Real(!high) - s) / w;
            if (enter > span.t0)
                span.t0 = enter, span.in = {a, high};
            if (leave < span.t1)
                span.t1 = leave, span.out = {a, !high};
        }
        return span;
    }

    // BOX-3, as it is often written. 0 * infinity is NaN, which sets a bound or none by the order of the arguments.
    Span plain_span(const Ray<Real>& ray) const
    {
        constexpr Real infinity = std::numeric_limits<Real>::infinity();
        const Vec3<Real> f = ray.origin - corner;
        Span span{-infinity, infinity, {}, {}};
        for (int a = 0; a < 3; a++) {
            const Real s = dot(g[a], f), w = dot(g[a], ray.direction), i = 1 / w;
            const Real x = (0 - s) * i, y = (1 - s) * i;
            const Real near = std::min(x, y), far = std::max(x, y);
            const bool high = w < 0;
            if (span.t0 < near)
                span.t0 = near, span.in = {a, high};
            if (far < span.t1)
                span.t1 = far, span.out = {a, !high};
        }
        return span;
    }

    // Parts of solids keep BOX-1 (BOX-3).
    Span own_span(const Ray<Real>& ray) const { return methods::plain_slabs ? plain_span(ray) : span(ray); }

    Real distance(const Ray<Real>& ray) const
    {
        const Span s = own_span(ray);
        if (!(s.t0 <= s.t1))
            return 0;
        return s.t0 > 0 ? s.t0 : s.t1;
    }

    // BOX-2
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Span s = own_span(ray);
        return surface(ray, t, s.t0 > 0 ? s.in : s.out);
    }

    Surface<Real> surface(const Ray<Real>& ray, Real t, Side side) const
    {
        const Vec3<Real> n = side.high ? normal[side.axis] : -normal[side.axis];
        const Vec3<Real> q = side.high ? corner + edge[side.axis] : corner;
        const Vec3<Real> p = ray.origin + t * ray.direction;
        return {p - dot(p - q, n) * n, n, size};
    }

    // HIT-6: rounding moves its hits further than the bounds of a hierarchy are padded for.
    bool always_tried() const { return !(skewness(edge, g) < 16); }

    Bounds<Real> bounds() const
    {
        Bounds<Real> bounds;
        for (int i = 0; i < 8; i++) {
            Vec3<Real> p = corner;
            for (int a = 0; a < 3; a++)
                p = i >> a & 1 ? p + edge[a] : p;
            bounds.hold(p);
        }
        return bounds;
    }
};
