// Random numbers that are a function of what they are for (RND-1 to RND-3): without a state, so any thread may draw.
#pragma once
#include "needs.hpp"

#include <array>
#include <cstdint>

using Words = std::array<std::uint32_t, 4>;

// RND-1: Philox4x32-10
constexpr Words philox(Words c, std::uint32_t k0, std::uint32_t k1)
{
    for (int round = 0; round < 10; round++) {
        const std::uint64_t p0 = std::uint64_t(0xD2511F53) * c[0], p1 = std::uint64_t(0xCD9E8D57) * c[2];
        c = {std::uint32_t(p1 >> 32) ^ c[1] ^ k0, std::uint32_t(p1),  //
             std::uint32_t(p0 >> 32) ^ c[3] ^ k1, std::uint32_t(p0)};
        k0 += 0x9E3779B9;
        k1 += 0xBB67AE85;
    }
    return c;
}

// The vectors of SPEC.md; the first three are the authors' own.
static_assert(philox({0, 0, 0, 0}, 0, 0) == Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
static_assert(philox({~0u, ~0u, ~0u, ~0u}, ~0u, ~0u) == Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
static_assert(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, 0xa4093822, 0x299f31d0) ==
              Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
static_assert(philox({1234, 5, 0, 0}, 42, 0) == Words{0x2155de9a, 0xf774bbf8, 0xfb0b0b50, 0x0edd2a24});
static_assert(philox({262143, 15, 37, 56}, 7, 0) == Words{0x82924c93, 0xe275186c, 0x4a489e55, 0xaf5eec32});
static_assert(philox({9, 1, 2, 0x80000003}, 0xffffffff, 0) == Words{0x77da3257, 0xfe76aa2d, 0x5215f5bd, 0x34d24b16});

// RND-2
template<typename Real>
constexpr Real uniform(std::uint32_t word)
{
    return Real(word >> 8) * Real(0x1p-24);
}

// Who draws (RND-3): a sample of a pixel. The ray's path and the use of the numbers come with each draw.
struct Draws {
    std::uint32_t pixel = 0, sample = 0, seed = 0;

    template<typename Real>
    std::array<Real, 4> operator()(Real, std::uint32_t path, std::uint32_t use) const
    {
        const Words words = philox({pixel, sample, path, use}, seed, 0);
        return {uniform<Real>(words[0]), uniform<Real>(words[1]), uniform<Real>(words[2]), uniform<Real>(words[3])};
    }
};
