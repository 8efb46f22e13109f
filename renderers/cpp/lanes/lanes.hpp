// VEC-1: several numbers side by side, a lane for each ray, as the compilers' own vectors, which have the operators of
// numbers. Vec3<Lanes<Real>> is a vector in each lane.
#pragma once
#include "../vector.hpp"

#include <bit>
#include <concepts>
#include <cstdint>
#include <limits>
#include <utility>
#ifdef __AVX__
#include <immintrin.h>
#endif

// What lanes go through must be inlined, or they go through memory.
#define LANE [[gnu::always_inline]] inline

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#define WIDE_LANES
constexpr int lane_bytes = 64;
#elif defined(__AVX__)
constexpr int lane_bytes = 32;
#else
constexpr int lane_bytes = 16;
#endif

template<typename Number>
struct Side {
    typedef Number By [[gnu::vector_size(lane_bytes)]];
};

template<typename Real> using Lanes = typename Side<Real>::By;
template<typename Real> using Integer = std::conditional_t<sizeof(Real) == 4, std::int32_t, std::int64_t>;
template<typename Real> using Integers = typename Side<Integer<Real>>::By;
template<typename Real> using Mask = Integers<Real>;  // of a lane all bits or none, as a comparison has it
template<typename Real> constexpr int lane_count = lane_bytes / int(sizeof(Real));

// The same number in all lanes.
template<std::floating_point Real>
LANE Lanes<Real> all(Real a)
{
    return a - Lanes<Real>{};
}

template<std::floating_point Real>
LANE Vec3<Lanes<Real>> all(Vec3<Real> a)
{
    return {all<Real>(a.x), all<Real>(a.y), all<Real>(a.z)};
}

// The same integer in all lanes.
template<typename Real>
LANE Integers<Real> every(Integer<Real> a)
{
    return a - Integers<Real>{};
}

// number(0), number(1), ..
template<typename Real, typename Number>
LANE Lanes<Real> lanes_of(const Number& number)
{
    Lanes<Real> lanes{};
    for (int k = 0; k < lane_count<Real>; k++)
        lanes[k] = Real(number(k));
    return lanes;
}

// What vectors have no operators for is asked of the processor by name: a compiler that prefers narrower vectors than
// these, as g++ does for some processors, would take a loop over the lanes apart, which makes all of it 10 times slower.
template<typename Real>
LANE Lanes<Real> root(Lanes<Real> a)
{
    [[maybe_unused]] constexpr bool narrow = sizeof(Real) == 4;
#ifdef WIDE_LANES
    if constexpr (narrow)
        return _mm512_maskz_sqrt_ps(__mmask16(-1), a);
    else
        return _mm512_maskz_sqrt_pd(__mmask8(-1), a);
#elif defined(__AVX__)
    if constexpr (narrow)
        return _mm256_sqrt_ps(a);
    else
        return _mm256_sqrt_pd(a);
#else
    for (int k = 0; k < lane_count<Real>; k++)
        a[k] = std::sqrt(a[k]);
    return a;
#endif
}

template<typename Real>
LANE Lanes<Real> size(Lanes<Real> a)
{
    return a < 0 ? -a : a;
}

// a b + c, rounded once.
template<typename Real>
LANE Lanes<Real> fma(Lanes<Real> a, Lanes<Real> b, Lanes<Real> c)
{
    [[maybe_unused]] constexpr bool narrow = sizeof(Real) == 4;
#ifdef WIDE_LANES
    if constexpr (narrow)
        return _mm512_fmadd_ps(a, b, c);
    else
        return _mm512_fmadd_pd(a, b, c);
#elif defined(__AVX__) && defined(__FMA__)
    if constexpr (narrow)
        return _mm256_fmadd_ps(a, b, c);
    else
        return _mm256_fmadd_pd(a, b, c);
#else
    for (int k = 0; k < lane_count<Real>; k++)
        c[k] = std::fma(a[k], b[k], c[k]);
    return c;
#endif
}

template<typename Real>
LANE Lanes<Real> fused_dot(const Vec3<Lanes<Real>>& a, const Vec3<Lanes<Real>>& b)
{
    return fma<Real>(a.z, b.z, fma<Real>(a.y, b.y, a.x * b.x));
}

// a + s b
template<typename Real>
LANE Vec3<Lanes<Real>> along(const Vec3<Lanes<Real>>& a, Lanes<Real> s, const Vec3<Lanes<Real>>& b)
{
    return {fma<Real>(s, b.x, a.x), fma<Real>(s, b.y, a.y), fma<Real>(s, b.z, a.z)};
}

// 1 / sqrt(a), off by 2 u at most. Newton's steps y + y (1 - a y y) / 2 double the 14 good bits that the processor
// guesses, in less time than its roots and divisions take.
template<typename Real>
LANE Lanes<Real> inverse_root(Lanes<Real> a)
{
#ifdef WIDE_LANES
    Lanes<Real> y;
    if constexpr (sizeof(Real) == 4)
        y = _mm512_maskz_rsqrt14_ps(__mmask16(-1), a);
    else
        y = _mm512_maskz_rsqrt14_pd(__mmask8(-1), a);
#pragma GCC unroll 2
    for (int step = 0; step < int(sizeof(Real) / 4); step++)
        y = fma<Real>(y * Real(0.5), fma<Real>(-a * y, y, all(Real(1))), y);
    return y;
#else
    return 1 / root<Real>(a);
#endif
}

template<typename Real>
LANE Vec3<Lanes<Real>> scaled(Lanes<Real> s, const Vec3<Lanes<Real>>& a)
{
    return {s * a.x, s * a.y, s * a.z};
}

template<typename Real>
LANE Vec3<Lanes<Real>> either(Mask<Real> which, const Vec3<Lanes<Real>>& a, const Vec3<Lanes<Real>>& b)
{
    return {which ? a.x : b.x, which ? a.y : b.y, which ? a.z : b.z};
}

template<typename Real>
LANE Lanes<Real> most(Lanes<Real> a, Lanes<Real> b)
{
    return a > b ? a : b;
}

template<typename Real>
LANE Lanes<Real> least(Lanes<Real> a, Lanes<Real> b)
{
    return a < b ? a : b;
}

// 0, 1, ..
template<typename Real>
LANE Integers<Real> lane_numbers()
{
    Integers<Real> numbers{};
    for (int k = 0; k < lane_count<Real>; k++)
        numbers[k] = k;
    return numbers;
}

// The first so many lanes.
template<typename Real>
LANE Mask<Real> up_to(int count)
{
    return lane_numbers<Real>() < Integer<Real>(count);
}

template<typename Real>
LANE Vec3<Lanes<Real>> normalise(const Vec3<Lanes<Real>>& a)
{
    const Lanes<Real> s = inverse_root<Real>(fused_dot<Real>(a, a));
    return {s * a.x, s * a.y, s * a.z};
}

// A bit for each lane, the first lane's lowest.
template<typename Real>
LANE unsigned bits(Mask<Real> mask)
{
    [[maybe_unused]] constexpr bool narrow = sizeof(Real) == 4;
#ifdef WIDE_LANES
    if constexpr (narrow)
        return _mm512_movepi32_mask(__m512i(mask));
    else
        return _mm512_movepi64_mask(__m512i(mask));
#elif defined(__AVX__)
    if constexpr (narrow)
        return unsigned(_mm256_movemask_ps(__m256(mask)));
    else
        return unsigned(_mm256_movemask_pd(__m256d(mask)));
#else
    unsigned sum = 0;
    for (int k = 0; k < lane_count<Real>; k++)
        sum |= unsigned(mask[k] & 1) << k;
    return sum;
#endif
}

template<typename Real>
LANE bool any(Mask<Real> mask)
{
    return bits<Real>(mask) != 0;
}

// Is there a lane with a >= 0 and b > least? The hottest question; asked at once it costs no vector of bits.
template<typename Real>
LANE bool any_both(Lanes<Real> a, Lanes<Real> b, Real least)
{
#ifdef WIDE_LANES
    if constexpr (sizeof(Real) == 4)
        return _mm512_mask_cmp_ps_mask(_mm512_cmp_ps_mask(a, Lanes<Real>{}, _CMP_GE_OQ), b, all(least), _CMP_GT_OQ);
    else
        return _mm512_mask_cmp_pd_mask(_mm512_cmp_pd_mask(a, Lanes<Real>{}, _CMP_GE_OQ), b, all(least), _CMP_GT_OQ);
#else
    return any<Real>((a >= 0) & (b > least));
#endif
}

template<typename Real>
LANE int count(Mask<Real> mask)
{
    return std::popcount(bits<Real>(mask));
}

template<typename Real>
LANE Lanes<Real> load(const Real* from)
{
    Lanes<Real> lanes;
    __builtin_memcpy(&lanes, from, sizeof lanes);
    return lanes;
}

// Rows to columns: lane k of row j is lane j of row k afterwards. Squares of half the size change places, then those of
// a quarter in each, and so on.
template<typename Real>
LANE void transpose(Lanes<Real> (&rows)[lane_count<Real>])
{
    const auto swap_squares = [&]<int step, int... k>(std::integer_sequence<int, step>,
                                                      std::integer_sequence<int, k...>) {
        constexpr int n = lane_count<Real>;
#pragma GCC unroll 16
        for (int i = 0; i < n; i++)
            if (!(i & step)) {
                const Lanes<Real> a = rows[i], b = rows[i + step];
                rows[i] = __builtin_shufflevector(a, b, (k & step ? n + k - step : k)...);
                rows[i + step] = __builtin_shufflevector(a, b, (k & step ? n + k : k + step)...);
            }
    };
    const auto each = [&]<int step>(auto self, std::integer_sequence<int, step>) {
        if constexpr (step > 0) {
            swap_squares(std::integer_sequence<int, step>(), std::make_integer_sequence<int, lane_count<Real>>());
            self(self, std::integer_sequence<int, step / 2>());
        }
    };
    each(each, std::integer_sequence<int, lane_count<Real> / 2>());
}

// Reads a row of a table of `fields` columns for each lane; columns[i] has the i-th number of each row. Rows are read by
// whole vectors, so the table needs room for one behind its last row.
template<typename Real, int fields>
LANE void gather(const Real* table, Integers<Real> rows, Lanes<Real> (&columns)[fields])
{
    constexpr int n = lane_count<Real>;
    static_assert(fields % n == 0 || n % fields == 0);
    Lanes<Real> part[n];
    for (int first = 0; first < fields; first += n) {
        for (int k = 0; k < n; k++)
            part[k] = load(table + std::size_t(rows[k]) * fields + first);
        transpose<Real>(part);
        std::copy_n(part, std::min(n, fields), columns + first);
    }
}

// Writes the lanes that are wanted side by side to `to`, where there must be room for all: Lanes or Integers.
template<typename Real, typename Value, typename Number>
LANE void compress(Mask<Real> wanted, Value value, Number* to)
{
#ifdef WIDE_LANES
    if constexpr (sizeof(Real) == 4)
        _mm512_storeu_ps(to, _mm512_maskz_compress_ps(__mmask16(bits<Real>(wanted)), (Lanes<Real>)value));
    else
        _mm512_storeu_pd(to, _mm512_maskz_compress_pd(__mmask8(bits<Real>(wanted)), (Lanes<Real>)value));
#else
    for (unsigned left = bits<Real>(wanted); left != 0; left &= left - 1)
        *to++ = value[std::countr_zero(left)];
#endif
}
