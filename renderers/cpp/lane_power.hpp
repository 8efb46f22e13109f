// VEC-1: a power in lanes.
#pragma once
#include "lanes.hpp"

namespace lane_power {

constexpr double log2_of_e = 1.44269504088896340736, log_of_2 = 0.69314718055994530942;

// How many terms leave an error below u.
template<typename Real> constexpr int log_terms = sizeof(Real) == 4 ? 5 : 10;
template<typename Real> constexpr int exp_terms = sizeof(Real) == 4 ? 8 : 14;

template<typename Real> constexpr int digits = std::numeric_limits<Real>::digits - 1;

// log2 c = e + log2 f with f from sqrt(1/2) to sqrt 2, and log f = 2 (s + s^3/3 + ..) with s = (f - 1) / (f + 1).
template<typename Real>
LANE Lanes<Real> log2(Lanes<Real> c)
{
    constexpr Integer<Real> root_of_half = std::bit_cast<Integer<Real>>(Real(0.70710678118654752440));

    const Integers<Real> bits = Integers<Real>(c), e = (bits - root_of_half) >> digits<Real>;
    const Lanes<Real> f = Lanes<Real>(bits - (e << digits<Real>));
    const Lanes<Real> s = (f - 1) / (f + 1), square = s * s;
    Lanes<Real> sum = all(Real(2 * log2_of_e / (2 * log_terms<Real> - 1)));
#pragma GCC unroll 16
    for (int k = log_terms<Real> - 2; k >= 0; k--)
        sum = fma<Real>(sum, square, all(Real(2 * log2_of_e / (2 * k + 1))));
    return fma<Real>(sum, s, __builtin_convertvector(e, Lanes<Real>));
}

// 2^y = 2^n e^x with n the nearest integer and x = (y - n) log 2, for y <= 0. n goes through integers: fast-math would
// take y + shift - shift for y.
template<typename Real>
LANE Lanes<Real> exp2(Lanes<Real> y)
{
    constexpr Real least = std::numeric_limits<Real>::min_exponent;
    constexpr Real shift = 3 * Real(Integer<Real>(1) << (digits<Real> - 1));  // adding it rounds to an integer

    const Lanes<Real> shifted = (y < least ? all(least) : y) + shift;
    const Integers<Real> n = Integers<Real>(shifted) - std::bit_cast<Integer<Real>>(shift);
    const Lanes<Real> x = (y - __builtin_convertvector(n, Lanes<Real>)) * Real(log_of_2);
    Lanes<Real> sum = all(Real(1));
#pragma GCC unroll 16
    for (int k = exp_terms<Real> - 1; k > 0; k--)
        sum = fma<Real>(sum, x * Real(1.0 / k), all(Real(1)));
    return y < least ? Lanes<Real>{} : Lanes<Real>(Integers<Real>(sum) + (n << digits<Real>));
}

}  // namespace lane_power

// c^m for normal 0 < c <= 1 and m >= 0, as 2^(m log2 c). Rounding is some u of the exponent, so the result is off by
// some u of itself times m |log2 c|; since y 2^-y <= 0.54, by less than 4 u of 1. Below the smallest normal number it
// is 0.
template<typename Real>
LANE Lanes<Real> power(Lanes<Real> c, Lanes<Real> m)
{
    return lane_power::exp2<Real>(m * lane_power::log2<Real>(c));
}
