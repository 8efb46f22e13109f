// What this machine can do at most, for harness/process/calibration.py: multiply-adds a second, one at a time and in vectors as
// wide as the processor has them, and bytes a second from and to memory. Prints one line of JSON.
//     peak THREADS SECONDS    seconds for each kind of work
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#if defined(__AVX512F__)
constexpr int vector_bytes = 64;
#elif defined(__AVX__)
constexpr int vector_bytes = 32;
#else
constexpr int vector_bytes = 16;
#endif

template<typename Real>
struct Side {
    typedef Real By [[gnu::vector_size(vector_bytes)]];
};

static double now()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Multiply-adds, each of which waits for none of the 11 before it: more than two units need that take 4 cycles for one.
// `-ffp-contract=fast` fuses them; nothing that is not written as a vector becomes one (-fno-tree-vectorize).
template<typename Number, int lanes>
struct MultiplyAdd {
    static constexpr int chains = 12, rounds = 2000;
    static constexpr double work = 2.0 * chains * rounds * lanes;  // operations of a call

    Number sums[chains] = {};

    void operator()()
    {
        Number a[chains], factor = {}, term = {};
        factor += 0.75f, term += 0.25f;  // sums go to 1: neither large nor subnormal
        for (int i = 0; i < chains; i++)
            a[i] = sums[i];
        for (int round = 0; round < rounds; round++)
#pragma GCC unroll 12
            for (int i = 0; i < chains; i++)
                a[i] = a[i] * factor + term;
        for (int i = 0; i < chains; i++)
            sums[i] = a[i];
    }
};

// STREAM's triad (McCalpin 1995): two numbers read and one written. The arrays are larger than caches are.
struct Triad {
    static constexpr std::size_t size = 1 << 22;
    static constexpr double work = 3.0 * sizeof(double) * size;  // bytes of a call

    std::vector<double> a, b, c;

    Triad() : a(size, 1), b(size, 2), c(size, 3) {}

    void operator()()
    {
        for (std::size_t i = 0; i < size; i++)
            a[i] = b[i] + 0.5 * c[i];
    }
};

// Work a second that all threads do together, each for `seconds`, begun at the same moment: the sum of their rates.
template<typename Work>
double rate(int threads, double seconds)
{
    std::vector<double> rates(static_cast<std::size_t>(threads));
    std::atomic<int> ready{0};
    const auto labour = [&](int number) {
        Work work;
        work();
        ready++;
        while (ready < threads)
            std::this_thread::yield();
        long long calls = 0;
        const double start = now();
        double end;
        do {
            work();
            asm volatile("" : : "r"(&work) : "memory");  // its result may be looked at, so it must be there
            calls++;
            end = now();
        } while (end - start < seconds);
        rates[std::size_t(number)] = Work::work * double(calls) / (end - start);
    };
    std::vector<std::thread> others;
    for (int number = 1; number < threads; number++)
        others.emplace_back(labour, number);
    labour(0);
    for (std::thread& other : others)
        other.join();
    double sum = 0;
    for (const double one : rates)
        sum += one;
    return sum;
}

int main(int argc, char** argv)
{
    if (argc != 3)
        return 2;
    const int threads = std::atoi(argv[1]);
    const double seconds = std::atof(argv[2]);
    if (threads < 1 || !(seconds > 0))
        return 2;
    using Floats = Side<float>::By;
    using Doubles = Side<double>::By;
    std::printf("{\"threads\": %d, \"float32\": %.6g, \"float64\": %.6g, \"scalar_float32\": %.6g, "
                "\"scalar_float64\": %.6g, \"bytes\": %.6g, \"vector_bytes\": %d}\n",
                threads, rate<MultiplyAdd<Floats, vector_bytes / 4>>(threads, seconds),
                rate<MultiplyAdd<Doubles, vector_bytes / 8>>(threads, seconds),
                rate<MultiplyAdd<float, 1>>(threads, seconds), rate<MultiplyAdd<double, 1>>(threads, seconds),
                rate<Triad>(threads, seconds), vector_bytes);
}
