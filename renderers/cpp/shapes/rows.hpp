// The rows of a picture, dealt out to threads.
#pragma once
#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

// Calls row(j, worker) for every j below `rows`, on this thread and on others, one for each worker if there are rows
// for them. A thread that is done with a row takes the next. Who has a row changes nothing: rows share no data, and
// what a worker counts are integers. Threads are made anew for each frame: that costs some 0.01 ms, and a picture of
// one row needs none.
template<typename Worker, typename Row>
void for_each_row(int rows, std::vector<Worker>& workers, const Row& row)
{
    std::atomic<int> next{0};
    const auto work = [&](Worker* worker) {
        for (int j; (j = next++) < rows;)
            row(j, *worker);
    };
    std::vector<std::thread> others;
    for (int i = 1; i < std::min(int(workers.size()), rows); i++)
        others.emplace_back(work, &workers[std::size_t(i)]);
    work(&workers[0]);
    for (std::thread& other : others)
        other.join();
}
