// The parameters of a job, from flags of the form --key=value. Unknown keys are ignored.
#pragma once
#include "../methods.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

// A job that this program cannot do, in contrast to one that failed.
struct Unsupported : std::runtime_error {
    using std::runtime_error::runtime_error;
};

class Flags {
public:
    explicit Flags(const std::vector<std::string>& words)
    {
        for (const std::string& flag : words) {
            const std::size_t equals = flag.find('=');
            if (flag.compare(0, 2, "--") == 0 && equals != std::string::npos)
                values.emplace_back(flag.substr(2, equals - 2), flag.substr(equals + 1));
        }
    }

    // Empty if the flag is not there.
    std::string text(const char* key) const
    {
        for (const auto& [name, value] : values)
            if (name == key)
                return value;
        return "";
    }

    std::string folder(const char* key) const
    {
        if (text(key).empty())
            fail(key, "is missing");
        return text(key);
    }

    long long integer(const char* key, long long least, long long most, long long otherwise) const
    {
        const std::string value = text(key);
        const long long number = value.empty() ? otherwise : to_integer(key, value);
        if (number < least || number > most)
            fail(key, "must be from " + std::to_string(least) + " to " + std::to_string(most) + ", not " + value);
        return number;
    }

    int integer(const char* key, int least, int otherwise) const
    {
        return int(integer(key, least, std::numeric_limits<int>::max(), otherwise));
    }

    // A number >= 0.
    double number(const char* key, double otherwise) const
    {
        const std::string value = text(key);
        if (value.empty())
            return otherwise;
        char* end = nullptr;
        const double number = std::strtod(value.c_str(), &end);
        if (*end || !(number >= 0))
            fail(key, "must be a number that is not negative, not " + value);
        return number;
    }

    // A number in [0, 1).
    double fraction(const char* key, double otherwise) const
    {
        const double value = number(key, otherwise);
        if (!(value < 1))
            fail(key, "must be a number in [0, 1), not " + text(key));
        return value;
    }

    // The place in `names` of a method, the first if the flag is not there.
    int method(const char* key, std::span<const char* const> names) const
    {
        const std::string value = text(key);
        for (std::size_t i = 0; i < names.size(); i++)
            if (value == names[i] || value.empty())
                return int(i);
        throw Unsupported("does not support " + (key + (" '" + value + "'")));
    }

    // Names or numbers, by commas.
    std::vector<std::string> list(const char* key) const
    {
        std::vector<std::string> parts;
        std::string rest = text(key);
        while (!rest.empty()) {
            const std::size_t comma = rest.find(',');
            parts.push_back(rest.substr(0, comma));
            rest = comma == std::string::npos ? "" : rest.substr(comma + 1);
        }
        return parts;
    }

    static long long to_integer(const char* key, const std::string& value)
    {
        long long number = 0;
        const char* end = value.data() + value.size();
        if (const auto [stop, error] = std::from_chars(value.data(), end, number); error != std::errc() || stop != end)
            fail(key, "needs an integer, not '" + value + "'");
        return number;
    }

    [[noreturn]] static void fail(const char* key, const std::string& reason)
    {
        throw std::runtime_error("--" + (key + (" " + reason)));
    }

private:
    std::vector<std::pair<std::string, std::string>> values;
};

enum class Kind { image, rays };
enum class Precision { float64, float32 };
enum class Sampling { one, uniform, jittered, adaptive, sobol };
enum class Weight { plain, study };
enum class Walk { least, recursion, table, stack, chain };
enum class Accel { automatic, none, bvh };

constexpr const char* kinds[] = {"image", "rays"};
constexpr const char* precisions[] = {"float64", "float32"};
constexpr const char* samplings[] = {"one", "uniform", "jittered", "adaptive", "sobol"};
constexpr const char* weights[] = {"plain", "study"};
constexpr const char* walks[] = {"least", "recursion", "table", "stack", "chain"};
constexpr const char* accels[] = {"auto", "none", "bvh"};

// Of a sample in its pixel (CAM-4, SAM-6).
struct SamplePlace {
    double x, y;
};

struct Job {
    std::string folder, out;
    std::string dialog;  // folder of the pipes in which places are asked for (FRM-1); empty: all frames have `sample`
    Kind kind;
    Precision precision;
    Sampling sampling;
    Weight weight;
    Walk walk;
    Accel accel;
    int width = 0, height = 0;
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // CAM-5
    int depth, threads, frames, adaptive_depth, feelers, glossy_rays;
    int spp, row;  // samples of a pixel, and of each row of them that is added up by itself (SAM-3)
    std::uint32_t seed;
    bool shadows;
    SamplePlace sample;
    double adaptive_threshold, lens_radius, focal_distance, epsilon, cutoff, least_frame;
    double sliver;  // CSG-4
    std::vector<std::string> needs;

    explicit Job(const Flags& flags)
        : folder(flags.folder("job")), out(flags.folder("out")), dialog(flags.text("dialog")),
          kind(Kind(flags.method("kind", kinds))), precision(Precision(flags.method("precision", precisions))),
          sampling(Sampling(flags.method("sampler", samplings))),
          weight(Weight(flags.method("glossy_weight", weights))), walk(Walk(flags.method("walk", walks))),
          accel(Accel(flags.method("accel", accels))), depth(flags.integer("depth", 0, 0)),
          threads(flags.text("variant") == "cpp" ? 1 : flags.integer("threads", 1, 1)),
          frames(flags.integer("frames", 0, 0)), adaptive_depth(flags.integer("adaptive_depth", 0, 3)),
          feelers(flags.integer("feelers", 0, 0)),
          glossy_rays(flags.integer("glossy_rays", 0, 0)), seed(std::uint32_t(flags.integer("seed", 0, 0xffffffff, 0))),
          shadows(flags.integer("shadows", 0, 0) != 0),
          sample{flags.fraction("sample_x", 0.5), flags.fraction("sample_y", 0.5)},
          adaptive_threshold(flags.number("adaptive_threshold", 0.1)), lens_radius(flags.number("lens_radius", 0)),
          focal_distance(flags.number("focal_distance", 1)),
          epsilon(flags.number("epsilon", 0x1p-48)), cutoff(flags.fraction("cutoff", 0)),
          least_frame(flags.number("least_frame", 0)),
          sliver(flags.number("sliver", precision == Precision::float32 ? 0x1p-20 : 0x1p-49)), needs(flags.list("needs"))
    {
        for (const methods::Method& method : methods::all)
            require_method(flags, method);
        for (const std::string& need : needs)
            require(need);
        if (methods::vector == Vector::on && accel == Accel::none && !not_in_lanes().empty())
            throw Unsupported("has lanes for " + not_in_lanes() +
                              " only in a hierarchy: leave vector off, or accel as by default");
        read_samples(flags);
        if (kind == Kind::image) {
            read_size(flags);
            const bool grid = sampling == Sampling::uniform || sampling == Sampling::jittered;
            require("NEED_SUPERSAMPLING", needs::supersampling || !(grid || sampling == Sampling::sobol));
            require("NEED_SOBOL", needs::sobol || sampling != Sampling::sobol);
            require("NEED_ADAPTIVE", needs::adaptive || sampling != Sampling::adaptive);
            require("NEED_LENS", needs::lens || lens_radius == 0);
            require("NEED_CUTOFF", needs::cutoff || cutoff == 0 || !needs::reflection || depth == 0);
            if (sampling == Sampling::adaptive && cutoff > 0)
                throw Unsupported("does not support a cutoff with adaptive samples, which it could send elsewhere");
            if (sampling == Sampling::adaptive && adaptive_depth > 8)
                throw Unsupported("does not support an adaptive_depth above 8");
        }
        require("KIND_IMAGE", kind != Kind::image || needs::image);
        require("KIND_RAYS", kind != Kind::rays || needs::rays);
        require("PRECISION_FLOAT64", precision != Precision::float64 || needs::float64);
        require("PRECISION_FLOAT32", precision != Precision::float32 || needs::float32);
    }

    // VEC-1: can the picture go with its rays in lanes, or else (VEC-3) one by one through a hierarchy in lanes?
    bool has_rays_in_lanes() const { return not_in_lanes().empty(); }

private:
    // VEC-1: something of the job that rays in lanes cannot do; "" if they can do all.
    std::string not_in_lanes() const
    {
        constexpr std::string_view usual[] = {"sphere", "offset",  "triangle", "slab",       "csg",
                                              "merge",  "fresnel", "phong",    "renormalise"};
        for (const methods::Method& method : methods::all)
            if (method.built != 0 && std::find(std::begin(usual), std::end(usual), method.key) != std::end(usual))
                return std::string(method.key) + " " + method.value();
        if (walk != Walk::least && walk != Walk::chain)
            return std::string("the walk ") + walks[int(walk)];
        return kind == Kind::image ? "" : "rays jobs";
    }

    static void require(const std::string& need)
    {
        if (need == "region" || need == "rays")
            return;
        for (const needs::Need& known : needs::all)
            if (need == known.name)
                return require(known.macro, known.built);
        throw Unsupported("does not support " + need);
    }

    static void require(const char* macro, bool built)
    {
        if (!built)
            throw std::runtime_error(std::string("this program was built without -D") + macro +
                                     ": build it with that too, or without any such word for all that there is");
    }

    // A method that is chosen when the program is built.
    static void require_method(const Flags& flags, const methods::Method& method)
    {
        const int asked = flags.method(method.key, method.values);
        if (asked != method.built)
            throw std::runtime_error(std::string("this program was built for --") + method.key + "=" + method.value() +
                                     ": build it with what renderer.toml has for " +
                                     method.values[std::size_t(asked)]);
    }

    void read_samples(const Flags& flags)
    {
        spp = row = 1;
        if (sampling == Sampling::sobol) {
            spp = flags.integer("spp", 1, 1);
            while (row * row < spp)
                row++;
        } else if (sampling == Sampling::uniform || sampling == Sampling::jittered) {
            row = flags.integer("samples", 1, 1);
            spp = row * row;
        }
    }

    void read_size(const Flags& flags)
    {
        width = x1 = flags.integer("width", 1, 0);
        height = y1 = flags.integer("height", 1, 0);
        const std::vector<std::string> edges = flags.list("region");
        if (edges.empty())
            return;
        int* region[] = {&x0, &y0, &x1, &y1};
        for (std::size_t i = 0; i < 4 && edges.size() == 4; i++)
            *region[i] = int(Flags::to_integer("region", edges[i]));
        if (edges.size() != 4 || x0 < 0 || y0 < 0 || x0 > x1 || y0 > y1 || x1 > width || y1 > height)
            Flags::fail("region", "must be x0,y0,x1,y1 inside the picture, not " + flags.text("region"));
    }
};
