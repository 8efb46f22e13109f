// The rows of a picture, dealt out to threads.
#pragma once
#include "counts.hpp"

#include <algorithm>
#include <atomic>
#include <functional>
#include <thread>
#include <vector>

// Calls row(j, counts) for every j below `rows`, on this thread and on others if there are rows for them. A thread that
// is done with a row takes the next. Who has a row changes nothing: rows share no data, and counts are integers.
// Threads are made anew for each frame: that costs some 0.01 ms, and a picture of one row needs none.
template<typename Row>
Counts for_each_row(int rows, int threads, const Row& row)
{
    const std::size_t workers = std::size_t(std::max(1, std::min(threads, rows)));
    std::vector<Counts> counts(workers);
    std::atomic<int> next{0};
    const auto work = [&](Counts& sum) {
        Counts mine;  // in no other thread's cache line while it is counted in
        for (int j; (j = next++) < rows;)
            row(j, mine);
        sum = mine;
    };

    std::vector<std::thread> others;
    for (std::size_t i = 1; i < workers; i++)
        others.emplace_back(work, std::ref(counts[i]));
    work(counts[0]);
    for (std::thread& other : others)
        other.join();

    Counts sum;
    for (const Counts& more : counts)
        sum += more;
    return sum;
}
