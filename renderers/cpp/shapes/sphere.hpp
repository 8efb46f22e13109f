#pragma once
#include "bounds.hpp"
#include "quadratic.hpp"
#include "../ray.hpp"
#include "twofold.hpp"

template<typename Real>
struct Sphere {
    static constexpr bool narrow = sizeof(Real) < sizeof(double);
    static constexpr Real epsilon = std::numeric_limits<Real>::epsilon();  // 2 u

    Vec3<Real> centre;
    Real radius, square;  // square: of the radius

    explicit Sphere(const double* row)
        : centre(rounded<Real>(vec(row))), radius(Real(row[3])), square(radius * radius)
    {
    }

    // SPH-3: by the form that the program is built with. Most spheres are missed by so much that f·f - b² proves it, with
    // fewer operations: it and the l·l of SPH-1 are each off by less than 32 u f·f (NOTES.md).
    Real distance(const Ray<Real>& ray) const
    {
        if constexpr (roots_of_formula)
            return formula(ray);

        const Vec3<Real> f = ray.origin - centre;
        const Real b = dot(f, ray.direction), square_f = dot(f, f);
        if (methods::renormalises && square_f * (1 - 32 * epsilon) - b * b > square)
            return 0;
        if constexpr (methods::sphere == SphereForm::wide)
            return wide(ray);
        return robust(ray, f, b, square_f);
    }

    // SPH-1, with b of the other sign: the same numbers, and one negation less.
    Real robust(const Ray<Real>& ray, Vec3<Real> f, Real b, Real square_f) const
    {
        const Vec3<Real> l = from(f, b, ray.direction);
        const Real delta = square - dot(l, l);
        if constexpr (narrow) {
            const Real unsure = 4 * epsilon * radius * (std::abs(b) + radius);
            if (delta < -unsure)
                return 0;
            if (delta < unsure) [[unlikely]]
                return wide(ray);
        } else if (delta < 0)
            return 0;

        return nearest(-b, square_f - square, std::sqrt(delta));
    }

    // f - b d; of float32 rounded once, which pays for asking whether that was enough.
    static Vec3<Real> from(Vec3<Real> f, Real b, Vec3<Real> d)
    {
        if constexpr (narrow)
            return {std::fma(-b, d.x, f.x), std::fma(-b, d.y, f.y), std::fma(-b, d.z, f.z)};
        else
            return f - b * d;
    }

    // SPH-1, the end of it.
    static Real nearest(Real b, Real k, Real root)
    {
        if (k > 0)
            return b > 0 ? k / (b + root) : 0;
        return b >= 0 ? b + root : k / (b - root);
    }

    // SPH-3, textbook and stable.
    Real formula(const Ray<Real>& ray) const
    {
        const Vec3<Real> f = ray.origin - centre;
        return first_root<Real>(dot(ray.direction, ray.direction), 2 * dot(f, ray.direction), dot(f, f) - square);
    }

    // SPH-3: f, l and k in twice the digits, f and l of the other sign.
    [[gnu::noinline]] Real wide(const Ray<Real>& ray) const
    {
        const Vec3<Real>& d = ray.direction;
        const Real b = dot(centre - ray.origin, d);
        const Twofold<Real> f[] = {twosum(centre.x, -ray.origin.x), twosum(centre.y, -ray.origin.y),
                                   twosum(centre.z, -ray.origin.z)};
        const auto from_centre = [&](const Twofold<Real>& f, Real d) {
            const Twofold<Real> p = twoproduct(b, d), s = twosum(f.value, -p.value);
            return s.value + (s.error - p.error + f.error);
        };
        const Vec3<Real> m{from_centre(f[0], d.x), from_centre(f[1], d.y), from_centre(f[2], d.z)};
        const Vec3<Real> l = m - dot(m, d) * d;
        const Real delta = square - dot(l, l);
        if (delta < 0)
            return 0;

        Real k = 0, error = 0;
        for (const Twofold<Real>& part : f) {
            const Twofold<Real> h = twoproduct(part.value, part.value), s = twosum(k, h.value);
            k = s.value, error += s.error + h.error + 2 * part.value * part.error;
        }
        const Twofold<Real> h = twoproduct(radius, radius), s = twosum(k, -h.value);
        return nearest(b, s.value + (error + (s.error - h.error)), std::sqrt(delta));
    }

    // HIT-6
    static constexpr bool always_tried() { return roots_of_formula; }

    // CSG-1: where the line goes in and out.
    bool crossed(const Ray<Real>& ray, Real& in, Real& out) const
    {
        const Vec3<Real> f = centre - ray.origin;
        const Real b = dot(f, ray.direction);
        const Vec3<Real> l = f - b * ray.direction;
        const Real delta = square - dot(l, l);
        if (!(delta >= 0))
            return false;

        const Real k = dot(f, f) - square, root = std::sqrt(delta);
        if (b >= 0)
            out = b + root, in = out == 0 ? 0 : k / out;
        else
            in = b - root, out = k / in;
        return true;
    }

    // SPH-2
    Surface<Real> surface(const Ray<Real>& ray, Real t) const
    {
        const Vec3<Real> a = ray.origin + t * ray.direction - centre;
        const Vec3<Real> n = methods::renormalises ? normalise(a) : a / radius;  // NUM-4
        return {centre + radius * n, n, radius};
    }

    Bounds<Real> bounds() const { return around(centre, {radius, radius, radius}); }
};
