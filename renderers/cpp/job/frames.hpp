// What a frame makes; by contract 2 the places of its samples (FRM-1) and the checksums of its pictures (FRM-2).
#pragma once
#include "counts.hpp"
#include "job.hpp"
#include "../needs.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <vector>

// What a render makes.
template<typename Real>
struct Picture {
    std::vector<Real> pixels;
    [[no_unique_address]] List<needs::cutoff, Real, 'D'> dropped;  // CUT-2
    Counts counts;
};

constexpr long long most_renders = 4096, most_bytes = 64 << 20;  // of a frame whose pictures have checksums

// CRC-32, of zlib and of IEEE 802.3, eight bytes at a time: entry [k][b] is the remainder of byte b before k zeros.
inline std::uint32_t crc32(const void* data, std::size_t bytes)
{
    static const auto table = [] {
        std::array<std::array<std::uint32_t, 256>, 8> made{};
        for (std::uint32_t b = 0; b < 256; b++) {
            std::uint32_t c = b;
            for (int bit = 0; bit < 8; bit++)
                c = c & 1 ? 0xedb88320u ^ c >> 1 : c >> 1;
            made[0][b] = c;
        }
        for (std::size_t k = 1; k < 8; k++)
            for (std::size_t b = 0; b < 256; b++)
                made[k][b] = made[k - 1][b] >> 8 ^ made[0][made[k - 1][b] & 255];
        return made;
    }();
    const unsigned char* at = static_cast<const unsigned char*>(data);
    std::uint32_t c = 0xffffffffu;
    for (; bytes >= 8; bytes -= 8, at += 8) {
        const std::uint32_t low = c ^ (at[0] | at[1] << 8 | at[2] << 16 | std::uint32_t(at[3]) << 24);
        c = table[7][low & 255] ^ table[6][low >> 8 & 255] ^ table[5][low >> 16 & 255] ^ table[4][low >> 24] ^
            table[3][at[4]] ^ table[2][at[5]] ^ table[1][at[6]] ^ table[0][at[7]];
    }
    for (; bytes > 0; bytes--, at++)
        c = c >> 8 ^ table[0][(c ^ *at) & 255];
    return ~c;
}

// FRM-2: of the first `renders` pictures.
template<typename Real>
std::string checksums(const std::vector<Picture<Real>>& pictures, long long renders)
{
    std::string text;
    for (std::size_t i = 0; i < std::size_t(renders); i++) {
        char digits[9];
        const std::vector<Real>& pixels = pictures[i].pixels;
        std::snprintf(digits, sizeof digits, "%08x", unsigned(crc32(pixels.data(), pixels.size() * sizeof(Real))));
        text += digits;
    }
    return text;
}

// FRM-1: asks for the key of the places, once frame 0 was said.
inline std::array<std::uint32_t, 2> key_of_places(const Job& job)
{
    std::ofstream(job.dialog + "/question") << "places\n" << std::flush;
    std::array<std::uint32_t, 2> key{};
    std::ifstream answer(job.dialog + "/answer");
    if (!(answer >> key[0] >> key[1]))
        throw std::runtime_error("the question for the places of the later frames has no answer");
    return key;
}

// FRM-1
inline SamplePlace place_of(const std::array<std::uint32_t, 2>& key, int frame, long long render, const SamplePlace& own)
{
    const std::uint32_t count = std::uint32_t(frame) * std::uint32_t(most_renders) + std::uint32_t(render);
    const auto part = [&](std::uint32_t first, std::uint32_t step) { return ((first + count * step) >> 8) * 0x1p-24; };
    return {(15 * own.x + part(key[0], 3242174889u)) / 16, (15 * own.y + part(key[1], 2447445413u)) / 16};
}
