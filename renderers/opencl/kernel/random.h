// Random numbers that are a function of what they are for (RND-1 to RND-3): without a state, so any thread may draw.

// Who draws: a sample of a pixel. The ray's path and the use of the numbers come with each draw.
typedef struct {
    uint pixel, sample, seed;
} Draws;

typedef struct {
    real u[4];
} Uniform;

DEVICE Uniform draw(Draws who, uint path, uint use)
{
    uint c0 = who.pixel, c1 = who.sample, c2 = path, c3 = use, k0 = who.seed, k1 = 0;
    for (int round = 0; round < 10; round++) {
        const uint low0 = 0xD2511F53u * c0, high0 = mul_hi(0xD2511F53u, c0);
        const uint low1 = 0xCD9E8D57u * c2, high1 = mul_hi(0xCD9E8D57u, c2);
        c0 = high1 ^ c1 ^ k0, c1 = low1;
        c2 = high0 ^ c3 ^ k1, c3 = low0;
        k0 += 0x9E3779B9u, k1 += 0xBB67AE85u;
    }
    Uniform numbers;
    numbers.u[0] = (real)(c0 >> 8) * R(0x1p-24), numbers.u[1] = (real)(c1 >> 8) * R(0x1p-24);
    numbers.u[2] = (real)(c2 >> 8) * R(0x1p-24), numbers.u[3] = (real)(c3 >> 8) * R(0x1p-24);
    return numbers;
}
