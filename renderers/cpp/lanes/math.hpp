// VEC-1: powers, logarithms, sines and cosines in lanes.
#pragma once
#include "lanes.hpp"

namespace lane_math {

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

// For sizes below 2^(digits - 2). It goes through the bits: fast-math would take y + shift - shift for y.
template<typename Real>
LANE Integers<Real> nearest_integer(Lanes<Real> y)
{
    constexpr Real shift = 3 * Real(Integer<Real>(1) << (digits<Real> - 1));  // adding it rounds to an integer

    return Integers<Real>(y + shift) - std::bit_cast<Integer<Real>>(shift);
}

// 2^y = 2^n e^x with n the nearest integer and x = (y - n) log 2, for y <= 0.
template<typename Real>
LANE Lanes<Real> exp2(Lanes<Real> y)
{
    constexpr Real least = std::numeric_limits<Real>::min_exponent;

    const Integers<Real> n = nearest_integer<Real>(y < least ? all(least) : y);
    const Lanes<Real> x = (y - __builtin_convertvector(n, Lanes<Real>)) * Real(log_of_2);
    Lanes<Real> sum = all(Real(1));
#pragma GCC unroll 16
    for (int k = exp_terms<Real> - 1; k > 0; k--)
        sum = fma<Real>(sum, x * Real(1.0 / k), all(Real(1)));
    return y < least ? Lanes<Real>{} : Lanes<Real>(Integers<Real>(sum) + (n << digits<Real>));
}

}  // namespace lane_math

// c^m for normal 0 < c <= 1 and m >= 0, as 2^(m log2 c). Rounding is some u of the exponent, so the result is off by
// some u of itself times m |log2 c|; since y 2^-y <= 0.54, by less than 4 u of 1. Below the smallest normal number it
// is 0.
template<typename Real>
LANE Lanes<Real> power(Lanes<Real> c, Lanes<Real> m)
{
    return lane_math::exp2<Real>(m * lane_math::log2<Real>(c));
}

// log c for normal 0 < c <= 1, off by some u of itself.
template<typename Real>
LANE Lanes<Real> logarithm(Lanes<Real> c)
{
    return lane_math::log2<Real>(c) * Real(lane_math::log_of_2);
}

// e^x - 1 for x <= 0, off by some u of itself: 2^n p + (2^n - 1) with n the nearest integer to x / log 2 and
// p = e^r - 1 of the rest.
template<typename Real>
LANE Lanes<Real> expm1(Lanes<Real> x)
{
    using namespace lane_math;
    constexpr Real lowest = -Real(log_of_2) * (digits<Real> + 3);  // from there on it is -1

    x = x < lowest ? all(lowest) : x;
    const Integers<Real> n = nearest_integer<Real>(x * Real(log2_of_e));
    const Lanes<Real> r = fma<Real>(__builtin_convertvector(n, Lanes<Real>), all(-Real(log_of_2)), x);
    Lanes<Real> sum = all(Real(1));
#pragma GCC unroll 16
    for (int k = exp_terms<Real> - 1; k > 1; k--)
        sum = fma<Real>(sum, r * Real(1.0 / k), all(Real(1)));
    const Lanes<Real> scale = Lanes<Real>(Integers<Real>(all(Real(1))) + (n << digits<Real>));
    return fma<Real>(scale, sum * r, scale - 1);
}

template<typename Real>
struct Turn {
    Lanes<Real> cosine, sine;
};

// Of 2 pi u for 0 <= u < 1, off by some u: series of the angle to the nearest quarter of a turn.
template<typename Real>
LANE Turn<Real> turn(Lanes<Real> u)
{
    constexpr int terms = sizeof(Real) == 4 ? 5 : 9;

    const Integers<Real> quarter = lane_math::nearest_integer<Real>(4 * u);
    const Lanes<Real> x = (u - Real(0.25) * __builtin_convertvector(quarter, Lanes<Real>)) * Real(6.28318530717958647693);
    const Lanes<Real> square = x * x;
    Lanes<Real> c = all(Real(1)), s = all(Real(1));
#pragma GCC unroll 16
    for (int k = terms - 1; k > 0; k--) {
        c = fma<Real>(c, square * Real(-1.0 / ((2 * k - 1) * (2 * k))), all(Real(1)));
        s = fma<Real>(s, square * Real(-1.0 / ((2 * k) * (2 * k + 1))), all(Real(1)));
    }
    s = s * x;
    const Mask<Real> odd = (quarter & 1) != 0, sign_c = ((quarter + 1) & 2) != 0, sign_s = (quarter & 2) != 0;
    const Lanes<Real> a = odd ? s : c, b = odd ? c : s;
    return {sign_c ? -a : a, sign_s ? -b : b};
}
