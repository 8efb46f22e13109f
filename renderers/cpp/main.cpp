// A renderer after SPEC.md, in C++20 and nothing else: flags, then load, render, save (README.md has the contract).
#ifdef COUNT_OPERATIONS  // before all that calls std::sqrt and the like
#include "job/counted.hpp"
template<typename Real> using Number = Counted<Real>;
#else
template<typename Real> using Number = Real;
#endif
#include "job/events.hpp"
#include "sample.hpp"
#ifdef HAS_LANES
#include "lanes/image.hpp"
#endif

#include <atomic>
#include <cfloat>

#ifdef __FAST_MATH__
constexpr bool fast_math = true;
#else
constexpr bool fast_math = false;
#endif
static_assert(fast_math == (methods::floating_point == FloatingPoint::fast),
              "NUM-3: floating point is strict here; fast-math goes with -DFLOATING_POINT_FAST");
static_assert(FLT_EVAL_METHOD == 0 || fast_math, "NUM-1: arithmetic must be in the type that it is written in");

#ifndef FLAGS
#define FLAGS "unknown"
#endif
#ifndef OPTIONS  // more flags, with a space before each
#define OPTIONS ""
#endif

#if defined(__clang__)
const std::string compiler = __VERSION__;
#elif defined(__GNUC__)
const std::string compiler = "g++ " __VERSION__;
#else
const std::string compiler = "unknown";
#endif

constexpr double cold = 10;  // times as long as a later frame is the first at most

// Start and end of a batch of renders: frame() so many times.
template<typename Frame>
std::pair<double, double> batch(long long renders, const Frame& frame)
{
    const double start = now();
    for (long long i = 0; i < renders; i++) {
        frame();
        std::atomic_signal_fence(std::memory_order_seq_cst);  // the compiler may not know that the next makes the same
    }
    return {start, now()};
}

// How many renders last `least` seconds, a power of two up to `most`, if the first took `first` seconds; seconds(n): of
// so many. A batch that something interrupts is long for once: so two must be long enough.
template<typename Seconds>
long long how_many(double least, double first, long long most, const Seconds& seconds)
{
    long long renders = 1;
    for (double took = first; (took < least || seconds(renders) < least) && 2 * renders <= most;) {
        renders *= 2;
        took = seconds(renders);
    }
    return renders;
}

void say_frame(int index, std::pair<double, double> at, long long renders, const std::string& checksums)
{
    const auto [start, end] = at;
    if (checksums.empty())
        return say("frame", {{"index", json(index)}, {"start", json(start)}, {"end", json(end)},
                             {"renders", json(renders)}});
    say("frame", {{"index", json(index)}, {"start", json(start)}, {"end", json(end)}, {"renders", json(renders)},
                  {"checksums", json(checksums)}});
}

// The `render` phase: frame() once, and then job.frames times more, each of as many renders as last job.least_frame.
template<typename Frame>
void render(const Job& job, const Frame& frame)
{
    const Memory memory;
    long long renders = 1;
    for (int index = 0; index <= job.frames; index++) {
        const auto at = batch(renders, frame);
        say_frame(index, at, renders, "");
        const double took = at.second - at.first;
        if (index == 0 && job.frames > 0 && took < cold * job.least_frame)
            renders = how_many(job.least_frame, took, std::numeric_limits<long long>::max() / 2, [&](long long n) {
                const auto [start, end] = batch(n, frame);
                return end - start;
            });
    }
    memory.say_peaks();
    say_phase("render");
}

// `render` of pictures: paint(picture, place) makes one with its samples at a place. Returns that of frame 0; `room` is
// a picture of its size. In a dialog (contract 2) the later ones have places of their own, and checksums.
template<typename Real, typename Paint>
Picture<Real> render(const Job& job, Picture<Real> room, const Paint& paint)
{
    if (job.dialog.empty()) {
        render(job, [&] { paint(room, job.sample); });
        return room;
    }
    const Memory memory;
    std::vector<Picture<Real>> pictures;
    pictures.push_back(std::move(room));
    const auto painted = [&](const std::vector<SamplePlace>& places) {
        while (pictures.size() < places.size())
            pictures.push_back(pictures[0]);
        std::size_t next = 0;
        return batch((long long)(places.size()), [&] {
            paint(pictures[next], places[next]);
            next++;
        });
    };
    const auto at = painted({job.sample});
    say_frame(0, at, 1, checksums(pictures, 1));
    Picture<Real> first = pictures[0];
    long long renders = 1;
    const double took = at.second - at.first;
    if (took < cold * job.least_frame) {
        const long long bytes = std::max(1LL, (long long)(first.pixels.size() * sizeof(Real)));
        renders = how_many(job.least_frame, took, std::min(most_renders, most_bytes / bytes), [&](long long n) {
            const auto [start, end] = painted(std::vector<SamplePlace>(std::size_t(n), job.sample));
            return end - start;
        });
    }
    const std::array<std::uint32_t, 2> key = key_of_places(job);
    std::vector<SamplePlace> places(std::size_t(renders), job.sample);
    for (int index = 1; index <= job.frames; index++) {
        for (long long i = 0; i < renders; i++)
            places[std::size_t(i)] = place_of(key, index, i, job.sample);
        const auto span = painted(places);
        say_frame(index, span, renders, checksums(pictures, renders));
    }
    memory.say_peaks();
    say_phase("render");
    return first;
}

#ifdef COUNT_OPERATIONS
// Of one more frame.
void say_operations()
{
    say("operations", {{"sums", json(operations.sums)}, {"products", json(operations.products)},
                       {"divisions", json(operations.divisions)}, {"roots", json(operations.roots)},
                       {"functions", json(operations.functions)}});
}
#endif

std::string names(const std::vector<std::string>& list)
{
    std::string text;
    for (const std::string& name : list)
        text += (text.empty() ? "" : ", ") + json(name);
    return "[" + text + "]";
}

// The methods that the program is built for, of those that the job can depend on, as JSON entries.
inline std::string built_methods(const Job& job, const Scene& scene)
{
    const bool image = job.kind == Kind::image, bounces = image && needs::reflection && job.depth > 0;
    const std::pair<std::string, bool> asked[] = {
        {"floating_point", true},
        {"sphere", scene.spheres.rows() + scene.ellipsoids.rows() > 0},
        {"offset", bounces || (image && needs::shadows && job.shadows)},
        {"triangle", scene.polygon_ranges.rows() + scene.mesh_ranges.rows() > 0},
        {"slab", scene.boxes.rows() > 0},
        {"csg", scene.csg_ranges.rows() > 0},
        {"merge", scene.csg_ranges.rows() > 0 || !scene.precedence.data.empty()},
        {"fresnel", bounces},
        {"phong", image && needs::phong},
        {"renormalise", bounces},
    };
    std::string text;
    for (const auto& [key, matters] : asked)
        for (const methods::Method& method : methods::all)
            if (matters && key == method.key)
                text += ", " + json(key) + ": " + json(std::string(method.value()));
    return text;
}

// What the program was built with, and what it chose (`more`, JSON entries).
inline void say_used(const Job& job, const Scene& scene, bool accelerated, bool in_lanes, const std::string& more)
{
    std::vector<std::string> features;
    for (const needs::Need& need : needs::all)
        if (need.built)
            features.push_back(need.name);
    if (needs::rays)
        features.push_back("rays");
    std::string methods = "{\"precision\": " + json(std::string(precisions[int(job.precision)]));
    methods += ", \"threads\": " + json(job.threads) + built_methods(job, scene);
    methods += std::string(", \"accel\": ") + (accelerated ? "\"bvh\"" : "\"none\"");
    methods += std::string(", \"vector\": ") + (in_lanes ? "\"on\"" : "\"off\"") + more + "}";
    say("versions", {{"compiler", json(compiler)}, {"standard", json(__cplusplus)}, {"flags", json(FLAGS OPTIONS)}});
    say("used", {{"features", names(features)}, {"methods", methods}});
}

void say_rays(const Counts& counts)
{
    say("rays", {{"primary", json(counts.primary)}, {"reflected", json(counts.reflected)},
                 {"transmitted", json(counts.transmitted)}, {"shadow", json(counts.shadow)},
                 {"non_finite", json(counts.non_finite)}});
}

// The `build` phase, if there is something to build.
template<typename Real>
void build(const Job& job, Shapes<Real>& shapes, bool in_lanes)
{
    if (shapes.build(job, in_lanes))
        say_phase("build");
}

// VEC-1, VEC-4: are lanes asked for, or quicker? streams: of rays, or else rays one by one (VEC-3).
template<typename Real>
bool takes_lanes(const Job& job, const Shapes<Real>& shapes, bool streams)
{
    constexpr int least_side = 8;  // of a picture in pixels, or most lanes of a block have none (NOTES.md has the times)
    if (methods::vector != Vector::automatic)
        return methods::vector == Vector::on;
    const bool large = std::min(job.x1 - job.x0, job.y1 - job.y0) >= least_side;
    return (large || !streams) && shapes.lanes_pay(job.accel, streams);
}

// A picture of the job's size, dark.
template<typename Real>
Picture<Real> room_for(const Job& job)
{
    const std::size_t pixels = std::size_t(job.y1 - job.y0) * std::size_t(job.x1 - job.x0);
    Picture<Real> room;
    room.pixels.resize(pixels * 3);
    if constexpr (needs::cutoff)
        room.dropped.resize(pixels);
    return room;
}

// All frames; `image` makes a picture with its workers. Returns that of frame 0.
template<typename Real, typename Image, typename Worker>
Picture<Real> render_with(const Job& job, Picture<Real> room, Image& image, std::vector<Worker>& workers)
{
    const auto paint = [&](Picture<Real>& picture, const SamplePlace& place) {
        for (Worker& worker : workers)
            worker.desk.counts = {};
        image.render(workers, picture, place);
        picture.counts = {};
        for (const Worker& worker : workers)
            picture.counts += worker.desk.counts;
    };
    Picture<Real> picture = render(job, std::move(room), paint);
#ifdef COUNT_OPERATIONS
    operations = {};
    paint(picture, job.sample);
    say_operations();
#endif
    return picture;
}

// Returns whether rays were cut off.
template<typename Real>
bool save(const Job& job, const Picture<Real>& picture)
{
    const std::size_t rows = std::size_t(job.y1 - job.y0), columns = std::size_t(job.x1 - job.x0);
    const bool cuts = needs::cutoff && job.cutoff > 0;
    say_rays(picture.counts);
    write_npy(job.out + "/image.npy", {rows, columns, 3}, picture.pixels);
    if constexpr (needs::cutoff)
        if (cuts)
            write_npy(job.out + "/dropped.npy", {rows, columns}, picture.dropped);
    say_phase("save");
    say("output", {{"file", "\"image.npy\""}, {"dropped", cuts ? "\"dropped.npy\"" : "null"}});
    return cuts;
}

#ifdef HAS_LANES
// VEC-1: can the picture have its rays in lanes?
template<typename Real>
bool has_streams(const Job& job, const Scene& scene)
{
    if (!job.has_rays_in_lanes())
        return false;
    if (needs::touching && methods::merges && !scene.precedence.data.empty()) {  // MED-6
        if (methods::vector == Vector::on && job.accel == Accel::none)
            throw Unsupported("has lanes for surfaces in one place (MED-6) only in a hierarchy: leave vector off, or accel "
                              "as by default");
        return false;
    }
    const bool fits = LaneMedia<Real>::fits(scene.media.rows());
    if (!fits && methods::vector == Vector::on && job.accel == Accel::none)
        throw Unsupported("has lanes for " + std::to_string(scene.media.rows()) +
                          " solids that share places only in a hierarchy: leave vector off, or accel as by default");
    return fits;
}

template<typename Real>
void make_image_in_lanes(const Job& job, const Scene& scene, Tracer<Real>& tracer)
{
    require_chain(job.walk, tracer.children());
    const bool few = tracer.shapes.few_for_lanes(job.accel);
    LaneImage<Real> image(scene, job, tracer, few);
    std::vector<LaneImageWorker<Real>> workers(std::size_t(job.threads));
    for (LaneImageWorker<Real>& worker : workers)
        image.make_room(worker);
    Picture<Real> room = room_for<Real>(job);
    say_phase("load");
    if (!few)
        build(job, tracer.shapes, true);

    const Picture<Real> picture = render_with(job, std::move(room), image, workers);
    const bool cuts = save(job, picture);
    std::string more = ", \"walk\": " + json(std::string(tracer.children() == 1 ? "chain" : "streams"));
    more += ", \"lanes\": " + json(lane_count<Real>);
    if (tracer.glossy_rays > 0)
        more += ", \"glossy_weight\": " + json(std::string(weights[int(job.weight)]));
    if (cuts)
        more += ", \"cutoff\": " + exact(job.cutoff);
    say_used(job, scene, !few, true, more);
}
#endif

template<typename Real>
void make_image(const Job& job)
{
    Scene scene;
    read_scene(job.folder, scene);
    Tracer<Real> tracer(scene, job);
    bool streams = false;
#ifdef HAS_LANES
    streams = has_streams<Real>(job, scene);
#endif
    const bool in_lanes = takes_lanes(job, tracer.shapes, streams);
#ifdef HAS_LANES
    if (in_lanes && streams)
        return make_image_in_lanes(job, scene, tracer);
#endif
    const Walker<Real> walker(tracer, job.walk, job.cutoff);
    Sampler<Real> sampler(scene, job, walker);
    std::vector<Worker<Real>> workers(std::size_t(job.threads));
    for (Worker<Real>& worker : workers)
        sampler.make_room(worker);
    Picture<Real> room = room_for<Real>(job);
    say_phase("load");
    build(job, tracer.shapes, in_lanes);

    const Picture<Real> picture = render_with(job, std::move(room), sampler, workers);
    const bool cuts = save(job, picture);

    std::string more = ", \"walk\": " + json(std::string(walks[int(walker.method())]));
    if (walker.has_rows())
        more += ", \"walk_rows\": " + json(walker.row_count()) + ", \"walk_bytes\": " + json(walker.bytes());
    if (tracer.glossy_rays > 0)
        more += ", \"glossy_weight\": " + json(std::string(weights[int(job.weight)]));
    if (cuts)
        more += ", \"cutoff\": " + exact(job.cutoff);
    say_used(job, scene, tracer.shapes.accelerated(), in_lanes, more);
}

// t, point, normal and object of a ray's first hit.
template<typename Real>
void answer_ray(const Shapes<Real>& shapes, const Ray<Real>& ray, Desk<Real>& desk, double* answer)
{
    const Probe<Real> probe = desk.probe(ray);
    const Hit<Real> hit = shapes.nearest(probe);
    std::fill(answer, answer + 8, 0.0);
    answer[0] = double(hit.t);
    answer[7] = -1;
    if (hit.shape < 0)
        return;
    const Surface<Real> at = shapes.surface(probe, hit);
    answer[1] = double(at.point.x), answer[2] = double(at.point.y), answer[3] = double(at.point.z);
    answer[4] = double(at.normal.x), answer[5] = double(at.normal.y), answer[6] = double(at.normal.z);
    answer[7] = shapes.roles[std::size_t(hit.shape)].object;
}

// NUM-4: a given direction, as it is if it has unit length to rounding: to turn it by some u is to miss by u of the
// distance.
template<typename Real>
Vec3<Real> unit(Vec3<double> given)
{
    const Vec3<Real> d = rounded<Real>(given);
    if (std::abs(dot(d, d) - 1) <= 2 * std::numeric_limits<Real>::epsilon())  // 4 u
        return d;
    return rounded<Real>(normalise(given));
}

template<typename Real>
void answer_rays(const Job& job)
{
    constexpr std::size_t block = 256;  // rays that a thread takes at a time

    Scene scene;
    read_scene(job.folder, scene);
    Shapes<Real> shapes(scene, job);
    std::vector<Desk<Real>> desks(std::size_t(job.threads));
    for (Desk<Real>& desk : desks)
        shapes.make_room(desk.scratch);
    std::vector<Ray<Real>> rays;
    Array<double> table;
    read_table(job.folder, "rays", 6, table);
    for (std::size_t i = 0; i < table.rows(); i++) {
        rays.push_back({rounded<Real>(vec(table.row(i))), unit<Real>(vec(table.row(i) + 3))});
    }
    std::vector<double> hits(rays.size() * 8);
    say_phase("load");
    const bool in_lanes = takes_lanes(job, shapes, false);
    build(job, shapes, in_lanes);

    const auto answer_all = [&] {
        for_each_row(int((rays.size() + block - 1) / block), desks, [&](int row, Desk<Real>& desk) {
            const std::size_t first = std::size_t(row) * block;
            for (std::size_t i = first; i < std::min(first + block, rays.size()); i++)
                answer_ray(shapes, rays[i], desk, hits.data() + i * 8);
        });
    };
    render(job, answer_all);
#ifdef COUNT_OPERATIONS
    operations = {};
    answer_all();
    say_operations();
#endif

    write_npy(job.out + "/hits.npy", {rays.size(), 8}, hits);
    say_phase("save");
    say("output", {{"file", "\"hits.npy\""}});
    say_used(job, scene, shapes.accelerated(), in_lanes, "");
}

// Compiles what the program is built for, and nothing else.
template<typename Real, bool wanted>
void run(const Job& job)
{
    if constexpr (wanted && needs::image)
        if (job.kind == Kind::image)
            make_image<Real>(job);
    if constexpr (wanted && needs::rays)
        if (job.kind == Kind::rays)
            answer_rays<Real>(job);
}

// Does one job; returns its exit status.
int attempt(const Flags& flags)
try {
    const Job job(flags);
    say_phase("import");
    if (job.precision == Precision::float32)
        run<Number<float>, needs::float32>(job);
    else
        run<Number<double>, needs::float64>(job);
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

int main(int argc, char** argv)
{
    const Flags flags({argv + 1, argv + argc});
    const std::string jobs = flags.text("jobs");
    if (jobs.empty())
        return attempt(flags);
    std::ifstream list(jobs);
    std::vector<std::string> words;
    for (std::string line; std::getline(list, line);) {
        if (!line.empty()) {
            words.push_back(line);
            continue;
        }
        phase_start = now();
        say("end", {{"status", json(attempt(Flags(words)))}});
        words.clear();
    }
    return 0;
}
