// From a pixel to its samples (CAM-4, SAM-1 to SAM-6).
#pragma once
#include "camera.hpp"
#include "job/frames.hpp"
#include "shapes/rows.hpp"
#include "walk.hpp"

#include <utility>

// A point of the lattice inside a pixel, and the last pixel that asked for it (SAM-5).
template<typename Real>
struct Point {
    Vec3<Real> colour;
    std::uint64_t pixel = 0;
};

// What a thread has of its own, in cache lines of its own.
template<typename Real>
struct alignas(128) Worker {
    Desk<Real> desk;
    WalkRows<Real> rows;
    [[no_unique_address]] List<needs::adaptive, Point<Real>, 'p'> points;
    std::uint64_t pixel = 0;  // how many pixels this thread has begun with `adaptive`
    [[no_unique_address]] Only<needs::cutoff, Real, 'w'> dropped{0};  // CUT-2: of this pixel's samples so far
};

template<typename Real>
class Sampler {
public:
    Sampler(const Scene& scene, const Job& job, const Walker<Real>& walker)
        : job(job), camera(scene, job), walker(walker), side(needs::adaptive ? 1 << job.adaptive_depth : 1),
          columns(job.x1 - job.x0), rows(job.y1 - job.y0), threshold(Real(job.adaptive_threshold))
    {
    }

    void make_room(Worker<Real>& worker) const
    {
        walker.make_room(worker.rows);
        walker.tracer.shapes.make_room(worker.desk.scratch);
        if constexpr (needs::random)
            worker.desk.draws.seed = job.seed;
        if constexpr (needs::sobol)
            worker.desk.draws.sequence = walker.tracer.sequence;
        if constexpr (needs::adaptive)
            if (job.sampling == Sampling::adaptive)
                worker.points.resize(std::size_t(side + 1) * std::size_t(side + 1));
    }

    // One render, with its samples at a place. Each pixel is worked out by one thread, in an order that does not depend
    // on how many there are.
    void render(std::vector<Worker<Real>>& workers, Picture<Real>& picture, const SamplePlace& place)
    {
        place_x = Real(place.x), place_y = Real(place.y), shift_x = Real(place.x - 0.5), shift_y = Real(place.y - 0.5);
        if constexpr (needs::adaptive)
            if (job.sampling == Sampling::adaptive)
                trace_corners(workers);
        for_each_row(rows, workers, [&](int row, Worker<Real>& worker) {
            Real* pixel = picture.pixels.data() + std::size_t(row) * std::size_t(columns) * 3;
            for (int i = job.x0; i < job.x1; i++, pixel += 3) {
                const Vec3<Real> c = colour(i, job.y0 + row, worker);
                pixel[0] = c.x, pixel[1] = c.y, pixel[2] = c.z;
                if constexpr (needs::cutoff)
                    picture.dropped[std::size_t(row) * std::size_t(columns) + std::size_t(i - job.x0)] =
                        take_dropped(worker);
            }
        });
    }

private:
    const Job& job;
    Camera<Real> camera;
    const Walker<Real>& walker;
    int side;  // of a pixel, in steps of the lattice
    int columns, rows;
    Real place_x = 0, place_y = 0, shift_x = 0, shift_y = 0;  // of the render's samples (CAM-4, SAM-6)
    Real threshold;
    [[no_unique_address]] List<needs::adaptive, Vec3<Real>, 'c'> corners;  // of the region's pixels

    Vec3<Real> colour(int i, int j, Worker<Real>& worker) const
    {
        if constexpr (needs::adaptive)
            if (job.sampling == Sampling::adaptive) {
                worker.pixel++;
                return square(i, j, 0, 0, side, worker);
            }
        if constexpr (needs::supersampling)
            if (job.sampling != Sampling::one)
                return mean(i, j, worker);
        draw_for(worker, number(i, j), 0);
        return trace(Real(i) + place_x, Real(j) + place_y, worker);
    }

    // CUT-2: of a pixel.
    Real take_dropped(Worker<Real>& worker) const
    {
        Real sum = 0;
        if constexpr (needs::cutoff)
            sum = std::exchange(worker.dropped, Real(0));
        return sum / Real(job.spp);
    }

    // RND-3
    std::uint32_t number(int i, int j) const
    {
        return std::uint32_t(j) * std::uint32_t(job.width) + std::uint32_t(i);
    }

    static void draw_for(Worker<Real>& worker, std::uint32_t pixel, std::uint32_t sample)
    {
        if constexpr (needs::random)
            worker.desk.draws.pixel = pixel, worker.desk.draws.sample = sample;
    }

    // A sample at a place of the picture.
    Vec3<Real> trace(Real column, Real row, Worker<Real>& worker) const
    {
        Ray<Real> ray;
        if (needs::lens && job.lens_radius > 0)
            ray = through_lens(column, row, worker);
        else
            ray = camera.ray(column, row);
        Vec3<Real> c = walker.colour(ray, worker.desk, worker.rows);
        if constexpr (needs::cutoff)
            worker.dropped += std::exchange(worker.desk.dropped, Real(0));
        worker.desk.counts.primary++;
        worker.desk.counts.non_finite += !(is_finite(c.x) && is_finite(c.y) && is_finite(c.z));
        return c;
    }

    Ray<Real> through_lens(Real column, Real row, Worker<Real>& worker) const
    {
        if constexpr (needs::lens)
            return camera.ray_through_lens(column, row, worker.desk.draws.own(Real()));
        else
            return {};
    }

    // SAM-1 to SAM-3, SAM-7
    Vec3<Real> mean(int i, int j, Worker<Real>& worker) const
    {
        const int n = job.row;
        Vec3<Real> sum{0, 0, 0};
        for (int first = 0; first < job.spp; first += n) {
            Vec3<Real> line{0, 0, 0};
            for (int s = first; s < std::min(first + n, job.spp); s++) {
                draw_for(worker, number(i, j), std::uint32_t(s));
                Real x = Real(0.5), y = Real(0.5);
                if constexpr (needs::supersampling)
                    if (job.sampling != Sampling::uniform) {
                        const auto u = worker.desk.draws.own(Real());
                        x = u[0], y = u[1];
                    }
                if (job.sampling != Sampling::sobol)
                    x = (Real(s - first) + x) / Real(n), y = (Real(first / n) + y) / Real(n);
                line = line + trace(Real(i) + (x + shift_x), Real(j) + (y + shift_y), worker);
            }
            sum = sum + line;
        }
        return sum / Real(job.spp);
    }

    // SAM-4: a point of the lattice.
    Vec3<Real> trace_point(int a, int b, Worker<Real>& worker) const
    {
        draw_for(worker, std::uint32_t(b) * (std::uint32_t(side) * std::uint32_t(job.width) + 1) + std::uint32_t(a), 0);
        return trace(Real(a) / Real(side) + shift_x, Real(b) / Real(side) + shift_y, worker);
    }

    // SAM-5
    void trace_corners(std::vector<Worker<Real>>& workers)
    {
        if (rows == 0 || columns == 0)
            return;
        corners.resize(std::size_t(columns + 1) * std::size_t(rows + 1));
        for_each_row(rows + 1, workers, [&](int row, Worker<Real>& worker) {
            Vec3<Real>* corner = corners.data() + std::size_t(row) * std::size_t(columns + 1);
            for (int i = job.x0; i <= job.x1; i++)
                *corner++ = trace_point(i * side, (job.y0 + row) * side, worker);
        });
    }

    // SAM-5: the point (a, b) of the lattice of pixel (i, j).
    Vec3<Real> point(int i, int j, int a, int b, Worker<Real>& worker) const
    {
        if (a % side == 0 && b % side == 0)
            return corners[std::size_t(j - job.y0 + b / side) * std::size_t(columns + 1) +
                           std::size_t(i - job.x0 + a / side)];
        Point<Real>& point = worker.points[std::size_t(b) * std::size_t(side + 1) + std::size_t(a)];
        if (point.pixel != worker.pixel)
            point = {trace_point(i * side + a, j * side + b, worker), worker.pixel};
        return point.colour;
    }

    // SAM-4: the square of pixel (i, j) whose top left point is (a, b).
    Vec3<Real> square(int i, int j, int a, int b, int size, Worker<Real>& worker) const
    {
        const Vec3<Real> corner[4] = {point(i, j, a, b, worker), point(i, j, a + size, b, worker),
                                      point(i, j, a, b + size, worker), point(i, j, a + size, b + size, worker)};
        if (size == 1 || !differ(corner))
            return ((corner[0] + corner[1]) + (corner[2] + corner[3])) / Real(4);
        const int half = size / 2;
        const Vec3<Real> quarter[4] = {
            square(i, j, a, b, half, worker), square(i, j, a + half, b, half, worker),
            square(i, j, a, b + half, half, worker), square(i, j, a + half, b + half, half, worker)};
        return ((quarter[0] + quarter[1]) + (quarter[2] + quarter[3])) / Real(4);
    }

    bool differ(const Vec3<Real> (&c)[4]) const
    {
        for (int channel = 0; channel < 3; channel++) {
            const auto [least, most] = std::minmax({c[0][channel], c[1][channel], c[2][channel], c[3][channel]});
            if (most - least > threshold)
                return true;
        }
        return false;
    }
};
