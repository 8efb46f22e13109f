// What a surface does with light: Phong's highlight, and how much of a ray it reflects and transmits, and to where.
#pragma once
#include "methods.hpp"
#include "random.hpp"
#include "ray.hpp"

constexpr double pi = 3.14159265358979323846;

template<typename Real>
struct Light {
    Vec3<Real> position, colour;
    Real radius;

    explicit Light(const double* row)
        : position(rounded<Real>(vec(row))), colour(rounded<Real>(vec(row + 3))), radius(Real(row[6]))
    {
    }
};

// REF-1: N = n_i / n_t and M = mu_i / mu_t between the two sides of a surface.
template<typename Real>
struct Interface {
    Real n, m;

    bool matched() const { return n == 1 && m == 1; }  // the surface is not there
};

template<typename Real>
struct Material {
    Vec3<Real> diffuse;
    Real specular, exponent;
    Real lobe;  // GLO-2: the exponent of its glossy reflection; -1 of a perfect mirror
    Interface<Real> from_air, into_air;
    bool clear;  // MED-1

    Material(const double* row, const double* air)
        : diffuse(rounded<Real>(vec(row))), specular(Real(row[3])), exponent(Real(row[4])),
          lobe(row[3] > 0 && row[10] > 0 ? Real(2 / (row[10] * row[10]) - 2) : -1),
          clear(row[5] != 0 || row[6] != 0 || row[7] != 0)
    {
        const double n_air = std::sqrt(air[0] * air[1]), n = std::sqrt(row[8] * row[9]);
        from_air = {Real(n_air / n), Real(air[1] / row[9])};
        into_air = {Real(n / n_air), Real(row[9] / air[1])};
    }
};

// LOC-4: k_s cos^m, for a ray that arrives along `d` and a light that is seen along `l`.
template<typename Real>
Real highlight(const Material<Real>& material, Vec3<Real> d, Vec3<Real> n, Vec3<Real> l, Real n_l)
{
    const Real c = -dot(2 * n_l * n - l, d);
    if constexpr (!methods::clamps_phong)
        return material.specular * std::pow(c, material.exponent);
    return c > 0 ? material.specular * std::pow(std::min(c, Real(1)), material.exponent) : 0;
}

template<typename Real>
struct Fresnel {
    Real reflected, s;  // R, and the s of TRA-1, unless R is 1
};

// REF-2
template<typename Real>
Fresnel<Real> fresnel(Interface<Real> side, Real cosine)
{
    if (side.matched())
        return {0, 0};
    const Real c = methods::clamps_fresnel ? std::min(Real(1), cosine) : cosine;
    const Real x = 1 - side.n * side.n * (1 - c * c);
    if (methods::clamps_fresnel && x <= 0)
        return {1, 0};
    const Real s = std::sqrt(x);
    const Real a = (side.n * c - side.m * s) / (side.n * c + side.m * s);
    const Real b = (side.m * c - side.n * s) / (side.m * c + side.n * s);
    return {(a * a + b * b) / 2, s};
}

// NUM-4: of a direction that a surface made.
template<typename Real>
Vec3<Real> renormalise(Vec3<Real> d)
{
    return methods::renormalises ? normalise(d) : d;
}

// REF-3
template<typename Real>
Vec3<Real> reflect(Vec3<Real> d, Vec3<Real> n, Real d_n)
{
    return renormalise(d - 2 * d_n * n);
}

// TRA-1, at a surface that bounds a solid.
template<typename Real>
Vec3<Real> transmit(Interface<Real> side, Real s, Vec3<Real> d, Vec3<Real> n, Real d_n)
{
    if (side.matched())
        return d;
    const Real g = d_n <= 0 ? -s : s;
    return renormalise(side.n * d + (g - side.n * d_n) * n);
}

// SOF-2
template<typename Real>
Vec3<Real> on_unit_sphere(const std::array<Real, 2>& u)
{
    const Real z = 1 - 2 * u[0], w = std::sqrt(std::max(Real(0), 1 - z * z)), phi = Real(2 * pi) * u[1];
    return {w * std::cos(phi), w * std::sin(phi), z};
}

// GLO-2: a direction around the mirrored one, and its z, the cosine of the angle between them.
template<typename Real>
struct Lobe {
    Vec3<Real> direction;
    Real z;
};

template<typename Real>
Lobe<Real> glossy(Vec3<Real> r, Vec3<Real> n, Real exponent, const std::array<Real, 2>& u)
{
    const Real sigma = r.z >= 0 ? Real(1) : Real(-1), a = -1 / (sigma + r.z), b = r.x * r.y * a;  // GLO-3
    const Vec3<Real> p{1 + sigma * r.x * r.x * a, sigma * b, -sigma * r.x}, q{b, sigma + r.y * r.y * a, -r.y};

    const Real z = std::pow(1 - u[0], 1 / (exponent + 1));
    const Real w = std::sqrt(-std::expm1(2 * std::log(1 - u[0]) / (exponent + 1)));
    const Real phi = Real(2 * pi) * u[1], x = w * std::cos(phi), y = w * std::sin(phi);
    const Vec3<Real> direction = renormalise(x * p + y * q + z * r);
    if ((dot(direction, n) > 0) == (dot(r, n) > 0))
        return {direction, z};
    return {renormalise(z * r - x * p - y * q), z};
}
