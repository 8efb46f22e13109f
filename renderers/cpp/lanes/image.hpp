// VEC-1, VEC-2: a picture, tile by tile, and of each pixel sample by sample.
#pragma once
#include "../camera.hpp"
#include "../job/frames.hpp"
#include "tracer.hpp"
#include "../shapes/rows.hpp"

// SAM-4: a square of the lattice, of one of the pixels in work, and a point.
struct LaneSquare {
    int pixel, a, b, size;
};

struct LanePoint {
    int a, b;
};

// What a thread has for pixels in work: colours of their points, and whether they are there.
template<typename Real>
struct LanePoints {
    std::vector<Vec3<Real>> colours;
    std::vector<char> known;
    std::vector<LaneSquare> squares, next;
    std::vector<LanePoint> wanted;
    std::vector<std::size_t> homes;  // of what is wanted
};

template<typename Real>
struct LaneImageWorker : LaneWorker<Real> {
    [[no_unique_address]] Only<needs::adaptive, LanePoints<Real>, 'P'> points;
    [[no_unique_address]] List<needs::supersampling, Real, 'l'> lines;  // sums of a row of samples (SAM-3), 3 a pixel
};

template<typename Real>
class LaneImage {
    using Worker = LaneImageWorker<Real>;
    using L = Lanes<Real>;
    using I = Integers<Real>;

public:
    static constexpr int tile_width = 64, tile_height = 32, room = tile_width * tile_height;

    LaneImage(const Scene& scene, const Job& job, const Tracer<Real>& tracer, bool few)
        : job(job), camera(scene, job),
          tracer(tracer, job, vec(scene.camera.row(0)) + vec(scene.camera.row(3)), job.lens_radius, few),
          columns(job.x1 - job.x0), rows(job.y1 - job.y0), side(needs::adaptive ? 1 << job.adaptive_depth : 1),
          threshold(Real(job.adaptive_threshold))
    {
    }

    void make_room(Worker& worker) const
    {
        tracer.make_room(worker, room);
        if constexpr (needs::supersampling)
            worker.lines.resize(3 * room);
    }

    // One render, with its samples at a place. A tile is worked out by one thread and shares nothing with another.
    void render(std::vector<Worker>& workers, Picture<Real>& picture, const SamplePlace& place)
    {
        samples_at = place;
        if constexpr (needs::adaptive)
            if (job.sampling == Sampling::adaptive)
                return render_adaptive(workers, picture.pixels);
        const int across = (columns + tile_width - 1) / tile_width, down = (rows + tile_height - 1) / tile_height;
        for_each_row(across * down, workers, [&](int number, Worker& worker) {
            const int x0 = job.x0 + number % across * tile_width, y0 = job.y0 + number / across * tile_height;
            render_tile({x0, y0, std::min(x0 + tile_width, job.x1), std::min(y0 + tile_height, job.y1)}, worker,
                        picture.pixels, picture.dropped);
        });
    }

private:
    struct Tile {
        int x0, y0, x1, y1;
    };

    const Job& job;
    SamplePlace samples_at{0.5, 0.5};  // in a pixel, of the render (CAM-4, SAM-6)
    Camera<Real> camera;
    LaneTracer<Real> tracer;
    int columns, rows;
    int side;  // of a pixel, in steps of the lattice (SAM-4)
    Real threshold;
    [[no_unique_address]] List<needs::adaptive, Vec3<Real>, 'c'> corners;  // of the region's pixels (SAM-5)

    // The pixels of as many rays as there are lanes: a block, since rays that start alike go on alike for longer.
    static constexpr int block_width = lane_count<Real> < 4 ? lane_count<Real> : 4;
    static constexpr int block_height = lane_count<Real> / block_width;

    // The place in a tile's samples of a pixel: blocks one after another.
    static int place(int i, int j)
    {
        const int block = j / block_height * (tile_width / block_width) + i / block_width;
        return block * lane_count<Real> + j % block_height * block_width + i % block_width;
    }

    static void clear(Worker& worker, int samples)
    {
        for (std::vector<Real>& channel : worker.colours)
            std::fill_n(channel.begin(), samples, Real(0));
    }

    // SAM-1 to SAM-3, one sample of all pixels after the other.
    void render_tile(const Tile& tile, Worker& worker, std::vector<Real>& picture,
                     [[maybe_unused]] List<needs::cutoff, Real, 'D'>& dropped) const
    {
        if constexpr (needs::random)
            for (int j = tile.y0; j < tile.y1; j++)
                for (int i = tile.x0; i < tile.x1; i++)
                    worker.numbers[std::size_t(place(i - tile.x0, j - tile.y0))] =
                        std::uint32_t(j) * std::uint32_t(job.width) + std::uint32_t(i);
        if constexpr (needs::cutoff)
            std::fill(worker.dropped.begin(), worker.dropped.end(), Real(0));
        aim(tile, 0, 1, worker);
        for (int sample = 0; sample < job.spp; sample++) {
            worker.sample = std::uint32_t(sample);
            clear(worker, room);
            see(tile, sample, worker);
            tracer.follow(0, worker);
            write(tile, sample, worker, picture);
        }
        if constexpr (needs::cutoff)
            for_pixels(tile, [&](std::size_t pixel, std::size_t from) {
                dropped[pixel] = worker.dropped[from] / Real(job.spp);
            });
    }

    // Calls use(number in the picture, place in the tile) for all pixels of a tile.
    template<typename Use>
    void for_pixels(const Tile& tile, const Use& use) const
    {
        for (int j = tile.y0; j < tile.y1; j++)
            for (int i = tile.x0; i < tile.x1; i++)
                use(std::size_t(j - job.y0) * std::size_t(columns) + std::size_t(i - job.x0),
                    std::size_t(place(i - tile.x0, j - tile.y0)));
    }

    // Adds sample s of each pixel.
    void write(const Tile& tile, [[maybe_unused]] int s, Worker& worker, std::vector<Real>& picture) const
    {
        long long spoilt = 0;
        for_pixels(tile, [&](std::size_t pixel, std::size_t from) {
            Real* to = picture.data() + 3 * pixel;
            bool right = true;
            for (int c = 0; c < 3; c++) {
                const Real value = worker.colours[c][from];
                right = right && is_finite(value);
                if constexpr (needs::supersampling)
                    add(value, s, worker.lines[3 * from + std::size_t(c)], to[c]);
                else
                    to[c] = value;
            }
            spoilt += !right;
        });
        worker.desk.counts.non_finite += spoilt;
        worker.desk.counts.primary += (long long)(tile.x1 - tile.x0) * (tile.y1 - tile.y0);
    }

    // SAM-3: `line` is the sum of the row of samples so far, `sum` of the rows before it, at last the mean.
    void add(Real value, int s, Real& line, Real& sum) const
    {
        const int n = job.row;
        line = s % n == 0 ? value : line + value;
        if (s % n == n - 1 || s == job.spp - 1)
            sum = s < n ? line : sum + line;
        if (job.spp > 1 && s == job.spp - 1)
            sum /= Real(job.spp);
    }

    // The eye rays of sample s of a tile's pixels (CAM-2, CAM-3, LEN-1, SAM-1, SAM-2, SAM-7).
    void see(const Tile& tile, [[maybe_unused]] int s, Worker& worker) const
    {
        const I lane = lane_numbers<Real>();
        const L lane_column = __builtin_convertvector(lane % block_width, L);
        const L lane_row = __builtin_convertvector(lane / block_width, L);
        const Real shift_x = Real(samples_at.x - 0.5), shift_y = Real(samples_at.y - 0.5);
        const bool one = !needs::supersampling || job.sampling == Sampling::one;
        for (int j = tile.y0; j < tile.y1; j += block_height)
            for (int i = tile.x0; i < tile.x1; i += block_width) {
                const L column = Real(i) + lane_column, row = Real(j) + lane_row;
                const I pixel = lane + Integer<Real>(place(i - tile.x0, j - tile.y0));
                const Mask<Real> active = (column < Real(tile.x1)) & (row < Real(tile.y1));
                L u[4]{}, x = all(Real(0.5)), y = x;
                if constexpr (needs::random)
                    tracer.draw_own(pixel, worker, u);
                if (needs::supersampling && !one && job.sampling != Sampling::uniform)
                    x = u[0], y = u[1];
                if (needs::supersampling && !one && job.sampling != Sampling::sobol) {
                    x = (Real(s % job.row) + x) / Real(job.row);
                    y = (Real(s / job.row) + y) / Real(job.row);
                }
                x = one ? all(Real(samples_at.x)) : x + shift_x;
                y = one ? all(Real(samples_at.y)) : y + shift_y;
                shoot(active, column + x, row + y, pixel, u, worker);
            }
    }

    // Eye rays through places of the picture; u: the numbers of their samples.
    LANE void shoot(Mask<Real> active, L column, L row, I pixel, [[maybe_unused]] const L (&u)[4],
                    Worker& worker) const
    {
        const L x = column * (2 / camera.width) - 1, y = 1 - row * (2 / camera.height);
        Vec3<L> origin = all(camera.eye);
        Vec3<L> d = along<Real>(along<Real>(all(-camera.e), y, all(camera.v)), x, all(camera.u));
        if constexpr (needs::lens)
            if (job.lens_radius > 0) {
                const L rho = root<Real>(u[2]);
                const Turn<Real> phi = turn<Real>(u[3]);
                const Vec3<L> h = along<Real>(scaled<Real>(rho * phi.cosine, all(camera.lens_u)), rho * phi.sine,
                                              all(camera.lens_v));
                origin = origin + h;
                d = scaled<Real>(all(camera.focus), d) - h;
            }
        LaneRay<Real> ray{origin, normalise<Real>(d), {}};
        if constexpr (needs::attenuation)
            ray.branch.weight = all(Vec3<Real>{1, 1, 1});
        else
            ray.branch.weight = all(Real(1));
        ray.branch.pixel = pixel, ray.branch.inside = tracer.at_eye();
        if constexpr (needs::random)
            ray.branch.path = I{};
        tracer.meet(worker.ahead, active, ray, 0, worker);
    }

    // VEC-2: the shapes that eye rays of a tile may meet; low to high: where samples of a pixel can be. A rectangle's
    // furthest directions from any axis are those of its corners.
    void aim(const Tile& tile, double low, double high, Worker& worker) const
    {
        if (job.lens_radius > 0) {
            worker.ahead = tracer.shapes();
            return;
        }
        Vec3<double> corners[4], axis{0, 0, 0};
        for (int k = 0; k < 4; k++) {
            const double i = k % 2 ? tile.x1 - 1 + high : tile.x0 + low, j = k / 2 ? tile.y1 - 1 + high : tile.y0 + low;
            const Ray<Real> ray = camera.ray(Real(i + samples_at.x - 0.5), Real(j + samples_at.y - 0.5));
            corners[k] = ::normalise(Vec3<double>{ray.direction.x, ray.direction.y, ray.direction.z});
            axis = axis + corners[k];
        }
        axis = ::normalise(axis);
        double cosine = 1;
        for (const Vec3<double>& corner : corners)
            cosine = std::min(cosine, dot(axis, corner));
        const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
        worker.ahead.keep(tracer.shapes(), {{camera.eye.x, camera.eye.y, camera.eye.z}, axis, cosine, sine});
    }

    // ---- adaptive samples (SAM-4, SAM-5): of some pixels in work, the squares of one size after those of another, and
    // all the points that they ask for in lanes.

    // Traces points of the lattice; to(k, colour) takes that of the k-th.
    template<typename Take>
    void trace_points(const std::vector<LanePoint>& points, Worker& worker, const Take& take) const
    {
        const Real shift_x = Real(samples_at.x - 0.5), shift_y = Real(samples_at.y - 0.5);
        worker.sample = 0;
        for (std::size_t begin = 0; begin < points.size(); begin += room) {
            const int count = int(std::min(points.size() - begin, std::size_t(room)));
            clear(worker, count);
            if constexpr (needs::random)
                for (int k = 0; k < count; k++) {
                    const LanePoint& point = points[begin + std::size_t(k)];
                    worker.numbers[std::size_t(k)] =
                        std::uint32_t(point.b) * (std::uint32_t(side) * std::uint32_t(job.width) + 1) +
                        std::uint32_t(point.a);
                }
            for (int first = 0; first < count; first += lane_count<Real>) {
                L column{}, row{}, u[4]{};
                for (int k = 0; k < std::min(lane_count<Real>, count - first); k++) {
                    const LanePoint& point = points[begin + std::size_t(first + k)];
                    column[k] = Real(point.a) / Real(side) + shift_x, row[k] = Real(point.b) / Real(side) + shift_y;
                }
                const I pixel = lane_numbers<Real>() + Integer<Real>(first);
                if (needs::lens && job.lens_radius > 0)
                    tracer.draw_own(pixel, worker, u);
                shoot(up_to<Real>(count - first), column, row, pixel, u, worker);
            }
            tracer.follow(0, worker);
            for (int k = 0; k < count; k++) {
                const std::size_t from = std::size_t(k);
                const Vec3<Real> c{worker.colours[0][from], worker.colours[1][from], worker.colours[2][from]};
                worker.desk.counts.non_finite += !(is_finite(c.x) && is_finite(c.y) && is_finite(c.z));
                take(begin + from, c);
            }
            worker.desk.counts.primary += count;
        }
    }

    void render_adaptive(std::vector<Worker>& workers, std::vector<Real>& picture)
    {
        if constexpr (needs::adaptive) {
            if (rows == 0 || columns == 0)
                return;
            corners.resize(std::size_t(columns + 1) * std::size_t(rows + 1));
            const int most = std::max(1, (1 << 16) / ((side + 1) * (side + 1)));  // pixels in work
            const int height = std::clamp(most / 16, 1, 16), width = std::clamp(most / height, 1, 32);
            const auto tiles = [&](int all_columns, int all_rows, const auto& use) {
                const int across = (all_columns + width - 1) / width, down = (all_rows + height - 1) / height;
                for_each_row(across * down, workers, [&](int number, Worker& worker) {
                    const int x = job.x0 + number % across * width, y = job.y0 + number / across * height;
                    use(Tile{x, y, std::min(x + width, job.x0 + all_columns), std::min(y + height, job.y0 + all_rows)},
                        worker);
                });
            };
            tiles(columns + 1, rows + 1, [&](const Tile& tile, Worker& worker) { trace_corners(tile, worker); });
            tiles(columns, rows,
                  [&](const Tile& tile, Worker& worker) { refine(tile, worker, picture); });
        }
    }

    void trace_corners([[maybe_unused]] const Tile& tile, [[maybe_unused]] Worker& worker)
    {
        if constexpr (needs::adaptive) {
            std::vector<LanePoint> points;
            for (int j = tile.y0; j < tile.y1; j++)
                for (int i = tile.x0; i < tile.x1; i++)
                    points.push_back({i * side, j * side});
            aim(tile, 0, 0, worker);
            trace_points(points, worker, [&](std::size_t k, const Vec3<Real>& colour) {
                const int i = points[k].a / side - job.x0, j = points[k].b / side - job.y0;
                corners[std::size_t(j) * std::size_t(columns + 1) + std::size_t(i)] = colour;
            });
        }
    }

    void refine([[maybe_unused]] const Tile& tile, [[maybe_unused]] Worker& worker,
                [[maybe_unused]] std::vector<Real>& picture) const
    {
        if constexpr (needs::adaptive) {
            const int width = tile.x1 - tile.x0, count = width * (tile.y1 - tile.y0), pitch = side + 1;
            LanePoints<Real>& points = worker.points;
            const std::size_t places = std::size_t(count) * std::size_t(pitch * pitch);
            points.colours.resize(std::max(points.colours.size(), places));
            points.known.assign(places, false);
            points.squares.clear();
            const auto home = [&](int pixel, int a, int b) {
                return (std::size_t(pixel) * std::size_t(pitch) + std::size_t(b)) * std::size_t(pitch) + std::size_t(a);
            };
            for (int pixel = 0; pixel < count; pixel++) {
                const int i = tile.x0 + pixel % width - job.x0, j = tile.y0 + pixel / width - job.y0;
                for (int k = 0; k < 4; k++) {
                    const std::size_t to = home(pixel, k % 2 * side, k / 2 * side);
                    points.colours[to] = corners[std::size_t(j + k / 2) * std::size_t(columns + 1) + std::size_t(i + k % 2)];
                    points.known[to] = true;
                }
                points.squares.push_back({pixel, 0, 0, side});
            }
            aim(tile, 0, 1, worker);
            const auto corner = [&](const LaneSquare& s, int k) {
                return points.colours[home(s.pixel, s.a + k % 2 * s.size, s.b + k / 2 * s.size)];
            };
            while (!points.squares.empty()) {
                points.next.clear(), points.wanted.clear(), points.homes.clear();
                for (const LaneSquare& s : points.squares) {
                    if (s.size == 1 || !differ({corner(s, 0), corner(s, 1), corner(s, 2), corner(s, 3)}))
                        continue;
                    const int half = s.size / 2;
                    for (int k = 0; k < 9; k++) {
                        const int a = s.a + k % 3 * half, b = s.b + k / 3 * half;
                        const std::size_t to = home(s.pixel, a, b);
                        if (points.known[to])
                            continue;
                        points.known[to] = true;
                        points.wanted.push_back({(tile.x0 + s.pixel % width) * side + a,
                                                 (tile.y0 + s.pixel / width) * side + b});
                        points.homes.push_back(to);
                    }
                    for (int k = 0; k < 4; k++)
                        points.next.push_back({s.pixel, s.a + k % 2 * half, s.b + k / 2 * half, half});
                }
                trace_points(points.wanted, worker, [&](std::size_t k, const Vec3<Real>& colour) {
                    points.colours[points.homes[k]] = colour;
                });
                points.squares.swap(points.next);
            }
            for (int pixel = 0; pixel < count; pixel++) {
                const Vec3<Real> c = mean({pixel, 0, 0, side}, corner);
                const std::size_t i = std::size_t(tile.x0 + pixel % width - job.x0),
                                  j = std::size_t(tile.y0 + pixel / width - job.y0);
                Real* to = picture.data() + 3 * (j * std::size_t(columns) + i);
                to[0] = c.x, to[1] = c.y, to[2] = c.z;
            }
        }
    }

    // SAM-4
    template<typename Corner>
    Vec3<Real> mean(const LaneSquare& s, const Corner& corner) const
    {
        const Vec3<Real> c[4] = {corner(s, 0), corner(s, 1), corner(s, 2), corner(s, 3)};
        if (s.size == 1 || !differ({c[0], c[1], c[2], c[3]}))
            return ((c[0] + c[1]) + (c[2] + c[3])) / Real(4);
        const int half = s.size / 2;
        const auto quarter = [&](int k) {
            return mean({s.pixel, s.a + k % 2 * half, s.b + k / 2 * half, half}, corner);
        };
        return ((quarter(0) + quarter(1)) + (quarter(2) + quarter(3))) / Real(4);
    }

    bool differ(const std::array<Vec3<Real>, 4>& c) const
    {
        for (int channel = 0; channel < 3; channel++) {
            const auto [least, most] = std::minmax({c[0][channel], c[1][channel], c[2][channel], c[3][channel]});
            if (most - least > threshold)
                return true;
        }
        return false;
    }
};
