// A renderer after SPEC.md, in C++20 and nothing else: flags, then load, render, save (README.md has the contract).
#include "camera.hpp"
#include "events.hpp"
#include "job.hpp"
#include "rows.hpp"
#include "trace.hpp"

#include <cfloat>

#ifdef __FAST_MATH__
#error "NUM-3: floating point is strict here"
#endif
static_assert(FLT_EVAL_METHOD == 0, "NUM-1: arithmetic must be in the type that it is written in");

#ifndef FLAGS
#define FLAGS "unknown"
#endif

#if defined(__clang__)
const std::string compiler = __VERSION__;
#elif defined(__GNUC__)
const std::string compiler = "g++ " __VERSION__;
#else
const std::string compiler = "unknown";
#endif

// The `render` phase: frame() once, and then job.frames times more.
template<typename Frame>
void render(const Job& job, const Frame& frame)
{
    const Memory memory;
    for (int index = 0; index <= job.frames; index++) {
        const double frame_start = now();
        frame();
        const double frame_end = now();
        say("frame", {{"index", json(index)}, {"start", json(frame_start)}, {"end", json(frame_end)}});
    }
    memory.say_peaks();
    say_phase("render");
}

template<typename Real>
void make_image(const Job& job)
{
    const Scene scene = read_scene(job.folder);
    const Tracer<Real> tracer(scene, job);
    const Camera<Real> camera(scene, job.width, job.height, job.sample_x, job.sample_y);
    const int rows = job.y1 - job.y0, columns = job.x1 - job.x0;
    std::vector<Real> picture(std::size_t(rows) * std::size_t(columns) * 3);
    say_phase("load");

    Counts counts;
    render(job, [&] {
        counts = for_each_row(rows, job.threads, [&](int row, Counts& mine) {
            Real* pixel = picture.data() + std::size_t(row) * std::size_t(columns) * 3;
            for (int i = job.x0; i < job.x1; i++, pixel += 3) {
                const Vec3<Real> c = tracer.colour(camera.ray(i, job.y0 + row), mine);
                mine.primary++;
                mine.non_finite += !(std::isfinite(c.x) && std::isfinite(c.y) && std::isfinite(c.z));
                pixel[0] = c.x, pixel[1] = c.y, pixel[2] = c.z;
            }
        });
    });
    say("rays", {{"primary", json(counts.primary)}, {"reflected", json(counts.reflected)}, {"transmitted", "0"},
                 {"shadow", json(counts.shadow)}, {"non_finite", json(counts.non_finite)}});

    write_npy(job.out + "/image.npy", {std::size_t(rows), std::size_t(columns), 3}, picture);
    say_phase("save");
    say("output", {{"file", "\"image.npy\""}});
}

template<typename Real>
void answer_rays(const Job& job)
{
    constexpr int block = 256;  // rays that a thread takes at a time

    const Scene scene = read_scene(job.folder);
    const Tracer<Real> tracer(scene, job);
    std::vector<Ray<Real>> rays;
    const Array<double> table = read_table<double>(job.folder, "rays", 6);
    for (std::size_t i = 0; i < table.rows(); i++) {
        const Vec3<double> d = vec(table.row(i) + 3);
        rays.push_back({rounded<Real>(vec(table.row(i))), rounded<Real>(d / std::hypot(d.x, d.y, d.z))});
    }
    std::vector<double> hits(rays.size() * 8);
    say_phase("load");

    render(job, [&] {
        for_each_row(int((rays.size() + block - 1) / block), job.threads, [&](int row, Counts&) {
            const std::size_t first = std::size_t(row) * block;
            for (std::size_t i = first; i < std::min(first + block, rays.size()); i++) {
                const Hit<Real> hit = tracer.nearest(rays[i]);
                double* answer = hits.data() + i * 8;
                std::fill(answer, answer + 8, 0.0);
                answer[0] = hit.t;
                answer[7] = -1;
                if (hit.shape < 0)
                    continue;
                const Surface<Real> at = tracer.surface(rays[i], hit);
                answer[1] = at.point.x, answer[2] = at.point.y, answer[3] = at.point.z;
                answer[4] = at.normal.x, answer[5] = at.normal.y, answer[6] = at.normal.z;
                answer[7] = tracer.objects[std::size_t(hit.shape)];
            }
        });
    });

    write_npy(job.out + "/hits.npy", {rays.size(), 8}, hits);
    say_phase("save");
    say("output", {{"file", "\"hits.npy\""}});
}

template<typename Real>
void run(const Job& job)
{
    if (job.kind == "image")
        make_image<Real>(job);
    else
        answer_rays<Real>(job);
}

int main(int argc, char** argv)
try {
    const Job job(Flags(argc, argv));
    job.require({"sphere", "box", "polygon", "ellipsoid", "ambient", "diffuse", "phong", "shadows", "reflection",
                 "region", "rays"});
    say_phase("import");

    if (job.precision == "float32")
        run<float>(job);
    else
        run<double>(job);

    std::string features;
    for (const std::string& need : job.needs)
        features += (features.empty() ? "" : ", ") + json(need);
    const std::string methods = "{\"precision\": " + json(job.precision) + ", \"threads\": " + json(job.threads) +
                                ", \"contraction\": \"off\"}";
    say("versions", {{"compiler", json(compiler)}, {"standard", json(__cplusplus)}, {"flags", json(FLAGS)}});
    say("used", {{"features", "[" + features + "]"}, {"methods", methods}});
    return 0;
}
catch (const Unsupported& refusal) {
    say("error", {{"reason", json(refusal.what())}});
    return 3;
}
catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    say("error", {{"reason", json(error.what())}});
    return 1;
}
