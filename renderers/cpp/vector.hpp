// Three numbers: a point, a direction or a colour.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>

template<typename Real>
struct Vec3 {
    Real x, y, z;

    Real operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};

template<typename Real> Vec3<Real> operator+(Vec3<Real> a, Vec3<Real> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template<typename Real> Vec3<Real> operator-(Vec3<Real> a, Vec3<Real> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template<typename Real> Vec3<Real> operator*(Vec3<Real> a, Vec3<Real> b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
template<typename Real> Vec3<Real> operator*(Real s, Vec3<Real> a) { return {s * a.x, s * a.y, s * a.z}; }
template<typename Real> Vec3<Real> operator/(Vec3<Real> a, Real s) { return {a.x / s, a.y / s, a.z / s}; }
template<typename Real> Vec3<Real> operator-(Vec3<Real> a) { return {-a.x, -a.y, -a.z}; }

template<typename Real> Real dot(Vec3<Real> a, Vec3<Real> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template<typename Real> Real length(Vec3<Real> a) { return std::sqrt(dot(a, a)); }
template<typename Real> Vec3<Real> normalise(Vec3<Real> a) { return a / length(a); }
template<typename Real> Vec3<Real> absolute(Vec3<Real> a) { return {std::abs(a.x), std::abs(a.y), std::abs(a.z)}; }
template<typename Real> Real largest(Vec3<Real> a) { return std::max({std::abs(a.x), std::abs(a.y), std::abs(a.z)}); }

template<typename Real>
Vec3<Real> cross(Vec3<Real> a, Vec3<Real> b)
{
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// A row of a job's array, in float64 as it is stored.
inline Vec3<double> vec(const double* row) { return {row[0], row[1], row[2]}; }

// NUM-1: what the scene gives in float64 is rounded to the type of the arithmetic here, once.
template<typename Real>
Vec3<Real> rounded(Vec3<double> a)
{
    return {Real(a.x), Real(a.y), Real(a.z)};
}

// g with g_a · e_b = 1 if a = b, else 0: the coordinates of a point p along three edges are g_a · p.
inline std::array<Vec3<double>, 3> reciprocal(Vec3<double> e1, Vec3<double> e2, Vec3<double> e3)
{
    const double volume = dot(e1, cross(e2, e3));
    return {cross(e2, e3) / volume, cross(e3, e1) / volume, cross(e1, e2) / volume};
}

// How much an error in a point can grow on its way to coordinates along edges `e` and back: 1 if they are orthogonal.
template<typename Real>
Real skewness(const Vec3<Real> (&e)[3], const Vec3<Real> (&g)[3])
{
    return std::max({length(e[0]) * length(g[0]), length(e[1]) * length(g[1]), length(e[2]) * length(g[2])});
}
