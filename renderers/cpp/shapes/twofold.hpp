// Sums and products with the error that rounding made in them: together they are exact.
#pragma once
#include <cmath>

template<typename Real>
struct Twofold {
    Real value, error;
};

// Knuth, The Art of Computer Programming 2, 4.2.2.
template<typename Real>
Twofold<Real> twosum(Real a, Real b)
{
    const Real s = a + b, z = s - a;
    return {s, (a - (s - z)) + (b - z)};
}

template<typename Real>
Twofold<Real> twoproduct(Real a, Real b)
{
    const Real p = a * b;
    return {p, std::fma(a, b, -p)};
}

// a b - c d after Kahan: its sign is always right, whatever the compiler fuses.
template<typename Real>
Real difference_of_products(Real a, Real b, Real c, Real d)
{
    const Real w = c * d;
    return std::fma(a, b, -w) + std::fma(-c, d, w);
}
