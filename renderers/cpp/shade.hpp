// What a surface does with light: Phong's highlight, and how much of a ray it reflects.
#pragma once
#include "ray.hpp"

template<typename Real>
struct Light {
    Vec3<Real> position, colour;

    explicit Light(const double* row) : position(rounded<Real>(vec(row))), colour(rounded<Real>(vec(row + 3))) {}
};

// REF-1: N = n_i / n_t and M = mu_i / mu_t between the two sides of a surface.
template<typename Real>
struct Interface {
    Real n, m;

    Interface(double eps_i, double mu_i, double eps_t, double mu_t)
        : n(Real(std::sqrt(eps_i * mu_i) / std::sqrt(eps_t * mu_t))), m(Real(mu_i / mu_t))
    {
    }
};

template<typename Real>
struct Material {
    Vec3<Real> diffuse;
    Real specular, exponent;
    Interface<Real> from_air, into_air;

    Material(const double* row, const double* air)
        : diffuse(rounded<Real>(vec(row))), specular(Real(row[3])), exponent(Real(row[4])),
          from_air(air[0], air[1], row[8], row[9]), into_air(row[8], row[9], air[0], air[1])
    {
    }
};

// LOC-4: k_s cos^m, for a ray that arrives along `d` and a light that is seen along `l`.
template<typename Real>
Real highlight(const Material<Real>& material, Vec3<Real> d, Vec3<Real> n, Vec3<Real> l, Real n_l)
{
    const Real c = -dot(2 * n_l * n - l, d);
    return c > 0 ? material.specular * std::pow(std::min(c, Real(1)), material.exponent) : 0;
}

// REF-2. At x = 0 the formula gives 1 too, or 0/0 if c = 0.
template<typename Real>
Real fresnel(Interface<Real> side, Real cosine)
{
    const Real c = std::min(Real(1), cosine);
    const Real x = 1 - side.n * side.n * (1 - c * c);
    if (x <= 0)
        return 1;
    const Real s = std::sqrt(x);
    const Real a = (side.n * c - side.m * s) / (side.n * c + side.m * s);
    const Real b = (side.m * c - side.n * s) / (side.m * c + side.n * s);
    return (a * a + b * b) / 2;
}

// REF-3
template<typename Real>
Vec3<Real> reflect(Vec3<Real> d, Vec3<Real> n, Real d_n)
{
    return normalise(d - 2 * d_n * n);
}
