// CUDA C++ as a C++ compiler takes it: a thread of the processor for each thread of a block, one block after another.

#include <barrier>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <math.h>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#undef INFINITY
#undef NAN
#define uint cuda_uint  // the system has its own types of these names
#define ulong cuda_ulong
#define __device__
#define __global__
#define __constant__
#define __forceinline__ inline
#define __noinline__
#define __shared__ static  // blocks come one after another
#define __launch_bounds__(...)
#define __maxnreg__(...)
#define __syncthreads() together->arrive_and_wait()

struct Index {
    unsigned x, y;
};

static std::unique_ptr<std::barrier<>> together;
static Index gridDim, blockDim;
static thread_local Index blockIdx, threadIdx;

template <class To, class From> static To bits_of(From value)
{
    static_assert(sizeof(To) == sizeof(From));
    To bits;
    std::memcpy(&bits, &value, sizeof bits);
    return bits;
}

static int __clzll(long long set) { return __builtin_clzll((unsigned long long)set); }
static float __int_as_float(int bits) { return bits_of<float>(bits); }
static unsigned __float_as_uint(float x) { return bits_of<unsigned>(x); }
static long long __double_as_longlong(double x) { return bits_of<long long>(x); }
static int atomicOr(int *place, int bits) { return __atomic_fetch_or(place, bits, __ATOMIC_SEQ_CST); }
static unsigned __umulhi(unsigned a, unsigned b) { return (unsigned)((uint64_t)a * b >> 32); }
static double cospi(double x) { return std::cos(M_PI * x); }
static double sinpi(double x) { return std::sin(M_PI * x); }
static float cospi(float x) { return (float)std::cos(M_PI * (double)x); }
static float sinpi(float x) { return (float)std::sin(M_PI * (double)x); }

// Starts a kernel as the driver does: with an address for each argument, of as many bytes as the kernel says.
template <class... Types, std::size_t... Which>
static void start(void (*kernel)(Types...), void **addresses, std::index_sequence<Which...>)
{
    kernel(*(Types *)addresses[Which]...);
}

template <class... Types> static void launch(void (*kernel)(Types...), const unsigned *shape, void **addresses)
{
    gridDim = {shape[0], shape[1]}, blockDim = {shape[2], shape[3]};
    for (unsigned block = 0; block < gridDim.x * gridDim.y; block++) {
        together = std::make_unique<std::barrier<>>((std::ptrdiff_t)(blockDim.x * blockDim.y));
        std::vector<std::jthread> threads;
        for (unsigned thread = 0; thread < blockDim.x * blockDim.y; thread++)
            threads.emplace_back([=] {
                blockIdx = {block % gridDim.x, block / gridDim.x};
                threadIdx = {thread % blockDim.x, thread / blockDim.x};
                start(kernel, addresses, std::index_sequence_for<Types...>());
            });
    }
}
