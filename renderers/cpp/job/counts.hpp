#pragma once
#include <bit>
#include <cstdint>
#include <type_traits>

// CNT-1, CNT-2: of one frame.
struct Counts {
    long long primary = 0, reflected = 0, transmitted = 0, shadow = 0, non_finite = 0;

    void operator+=(const Counts& more)
    {
        primary += more.primary;
        reflected += more.reflected;
        transmitted += more.transmitted;
        shadow += more.shadow;
        non_finite += more.non_finite;
    }
};

// CNT-2. Of the bits, and where the compiler cannot see whose they are: fast-math (NUM-3) believes every number finite,
// and answers std::isfinite without a look.
template<typename Real>
bool is_finite(Real x)
{
    using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
    constexpr Bits exponent = sizeof(Real) == 4 ? Bits(0x7f800000) : Bits(0x7ff0000000000000);
    Bits bits = std::bit_cast<Bits>(x);
    asm("" : "+r"(bits));
    return (bits & exponent) != exponent;
}
