#pragma once
#include "bounds.hpp"
#include "needs.hpp"
#include "ray.hpp"

template<typename Real>
struct Sphere {
    Vec3<Real> centre;
    Real radius, square;  // square: of the radius

    explicit Sphere(const double* row)
        : centre(rounded<Real>(vec(row))), radius(Real(row[3])), square(radius * radius)
    {
    }

    // SPH-3: by the form that the program is built with.
    Real distance(const Ray<Real>& ray) const
    {
        if constexpr (needs::sphere_form == SphereForm::textbook)
            return textbook(ray);
        else if constexpr (needs::sphere_form == SphereForm::stable)
            return stable(ray);
        else
            return robust(ray);
    }

    // SPH-1, with f and l of the other sign: the same numbers, and one negation less in the hottest loop.
    // Most spheres are missed at the first comparison, so the root and the division stand behind it.
    Real robust(const Ray<Real>& ray) const
    {
        const Vec3<Real> f = centre - ray.origin;
        const Real b = dot(f, ray.direction);
        const Vec3<Real> l = f - b * ray.direction;
        const Real delta = square - dot(l, l);
        if (delta < 0)
            return 0;

        const Real k = dot(f, f) - square, root = std::sqrt(delta);
        if (k > 0)
            return b > 0 ? k / (b + root) : 0;
        return b >= 0 ? b + root : k / (b - root);
    }

    // SPH-3, the study's.
    Real textbook(const Ray<Real>& ray) const
    {
        const Vec3<Real> f = ray.origin - centre;
        const Real a = dot(ray.direction, ray.direction), h = 2 * dot(f, ray.direction), k = dot(f, f) - square;
        const Real delta = h * h - 4 * a * k;
        if (delta < 0)
            return 0;

        const Real root = std::sqrt(delta), near = (-h - root) / (2 * a);
        return near > 0 ? near : (-h + root) / (2 * a);
    }

    // SPH-3, of Numerical Recipes.
    Real stable(const Ray<Real>& ray) const
    {
        const Vec3<Real> f = ray.origin - centre;
        const Real a = dot(ray.direction, ray.direction), h = 2 * dot(f, ray.direction), k = dot(f, f) - square;
        const Real delta = h * h - 4 * a * k;
        if (delta < 0)
            return 0;

        const Real root = std::sqrt(delta), q = (h >= 0 ? h + root : h - root) / -2;
        const Real t0 = q / a, t1 = k / q, near = std::min(t0, t1);
        return near > 0 ? near : std::max(t0, t1);
    }

    // HIT-6: only the error of SPH-1 is known to stay within what the bounds are padded by.
    static constexpr bool always_tried() { return needs::sphere_form != SphereForm::robust; }

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
        const Vec3<Real> n = normalise(ray.origin + t * ray.direction - centre);
        return {centre + radius * n, n, radius};
    }

    Bounds<Real> bounds() const { return around(centre, {radius, radius, radius}); }
};
