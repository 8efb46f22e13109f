// VEC-1, VEC-2: a picture, tile by tile.
#pragma once
#include "camera.hpp"
#include "lane_tracer.hpp"
#include "rows.hpp"

template<typename Real>
class LaneImage {
public:
    static constexpr int tile_width = 64, tile_height = 32;
    static constexpr std::size_t tile_room = std::size_t(tile_width) * tile_height;

    LaneImage(const Scene& scene, const Job& job)
        : job(job), camera(scene, job), tracer(scene, job), across((job.x1 - job.x0 + tile_width - 1) / tile_width),
          down((job.y1 - job.y0 + tile_height - 1) / tile_height)
    {
    }

    // One frame. A tile is worked out by one thread and shares nothing with another.
    void render(std::vector<LaneWorker<Real>>& workers, std::vector<Real>& picture) const
    {
        for_each_row(across * down, workers, [&](int tile, LaneWorker<Real>& worker) {
            const int x0 = job.x0 + tile % across * tile_width, y0 = job.y0 + tile / across * tile_height;
            const Tile here{x0, y0, std::min(x0 + tile_width, job.x1), std::min(y0 + tile_height, job.y1)};
            for (std::vector<Real>& channel : worker.colours)
                std::fill(channel.begin(), channel.end(), Real(0));
            see(here, worker);
            tracer.follow(worker);
            write(here, worker, picture);
        });
    }

private:
    struct Tile {
        int x0, y0, x1, y1;
    };

    const Job& job;
    Camera<Real> camera;
    LaneTracer<Real> tracer;
    int across, down;

    // The pixels of as many rays as there are lanes: a block, since rays that start alike go on alike for longer.
    static constexpr int block_width = lane_count<Real> < 4 ? lane_count<Real> : 4;
    static constexpr int block_height = lane_count<Real> / block_width;

    // The eye rays of a tile (CAM-2, CAM-3).
    void see(const Tile& tile, LaneWorker<Real>& worker) const
    {
        const Vec3<Lanes<Real>> eye = all(camera.eye), u = all(camera.u), v = all(camera.v);
        const Vec3<Lanes<Real>> forward = all(-camera.e);
        const Lanes<Real> one = all(Real(1));
        const Lanes<Real> lane_column = lanes_of<Real>([](int k) { return k % block_width; });
        const Lanes<Real> lane_row = lanes_of<Real>([](int k) { return k / block_width; });
        worker.ahead.keep(tracer.spheres, cone(tile));
        worker.hits.count = 0;
        for (int j = tile.y0; j < tile.y1; j += block_height)
            for (int i = tile.x0; i < tile.x1; i += block_width) {
                const Lanes<Real> column = Real(i) + lane_column, row = Real(j) + lane_row;
                const Lanes<Real> x = (column + Real(job.sample_x)) * (2 / camera.width) - 1;
                const Lanes<Real> y = 1 - (row + Real(job.sample_y)) * (2 / camera.height);
                const Vec3<Lanes<Real>> d = along<Real>(along<Real>(forward, y, v), x, u);
                const Lanes<Real> pixel = (row - Real(tile.y0)) * Real(tile_width) + (column - Real(tile.x0));
                tracer.meet(worker.ahead, (column < Real(tile.x1)) & (row < Real(tile.y1)), eye,
                            normalise<Real>(d), one, pixel, worker);
            }
        worker.counts.primary += (long long)(tile.x1 - tile.x0) * (tile.y1 - tile.y0);
    }

    // VEC-2: a rectangle's furthest directions from any axis are those of its corners.
    Cone cone(const Tile& tile) const
    {
        Vec3<double> corners[4], axis{0, 0, 0};
        for (int k = 0; k < 4; k++) {
            const int i = k % 2 ? tile.x1 - 1 : tile.x0, j = k / 2 ? tile.y1 - 1 : tile.y0;
            const Ray<Real> ray = camera.ray(Real(i) + Real(job.sample_x), Real(j) + Real(job.sample_y));
            corners[k] = normalise(Vec3<double>{ray.direction.x, ray.direction.y, ray.direction.z});
            axis = axis + corners[k];
        }
        axis = normalise(axis);
        double cosine = 1;
        for (const Vec3<double>& corner : corners)
            cosine = std::min(cosine, dot(axis, corner));
        const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
        return {{camera.eye.x, camera.eye.y, camera.eye.z}, axis, cosine, sine};
    }

    void write(const Tile& tile, LaneWorker<Real>& worker, std::vector<Real>& picture) const
    {
        for (int j = tile.y0; j < tile.y1; j++) {
            const std::size_t from = std::size_t(j - tile.y0) * tile_width;
            const std::size_t width = std::size_t(job.x1 - job.x0);
            Real* to = picture.data() + (std::size_t(j - job.y0) * width + std::size_t(tile.x0 - job.x0)) * 3;
            const Real *r = &worker.colours[0][from], *g = &worker.colours[1][from], *b = &worker.colours[2][from];
            for (int k = 0; k < tile.x1 - tile.x0; k++)
                to[3 * k] = r[k], to[3 * k + 1] = g[k], to[3 * k + 2] = b[k];
            for (int k = 0; k < tile.x1 - tile.x0; k++)
                worker.counts.non_finite += !(is_finite(r[k]) && is_finite(g[k]) && is_finite(b[k]));
        }
    }
};
