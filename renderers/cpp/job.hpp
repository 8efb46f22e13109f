// The parameters of a job, from flags of the form --key=value. Unknown keys are ignored.
#pragma once
#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

// A job that this program cannot do, in contrast to one that failed.
struct Unsupported : std::runtime_error {
    using std::runtime_error::runtime_error;
};

class Flags {
public:
    Flags(int argc, char** argv)
    {
        for (int i = 1; i < argc; i++) {
            const std::string flag = argv[i];
            const std::size_t equals = flag.find('=');
            if (flag.compare(0, 2, "--") == 0 && equals != std::string::npos)
                values[flag.substr(2, equals - 2)] = flag.substr(equals + 1);
        }
    }

    std::string text(const std::string& key, const std::string& otherwise = "") const
    {
        return values.count(key) ? values.at(key) : otherwise;
    }

    std::string folder(const std::string& key) const
    {
        if (text(key).empty())
            throw std::runtime_error("--" + key + " is missing");
        return text(key);
    }

    int integer(const std::string& key, int least, int otherwise) const
    {
        const std::string value = text(key, std::to_string(otherwise));
        const int number = to_integer(key, value);
        if (number < least)
            throw std::runtime_error("--" + key + " must be at least " + std::to_string(least) + ", not " + value);
        return number;
    }

    double fraction(const std::string& key, double otherwise) const
    {
        const std::string value = text(key, std::to_string(otherwise));
        char* end = nullptr;
        const double number = std::strtod(value.c_str(), &end);
        if (value.empty() || *end || !(number >= 0 && number < 1))
            throw std::runtime_error("--" + key + " must be a number in [0, 1), not " + value);
        return number;
    }

    // Names or numbers, by commas.
    std::vector<std::string> list(const std::string& key) const
    {
        std::vector<std::string> parts;
        std::istringstream stream(text(key));
        for (std::string part; std::getline(stream, part, ',');)
            parts.push_back(part);
        return parts;
    }

    static int to_integer(const std::string& key, const std::string& value)
    {
        int number = 0;
        const char* end = value.data() + value.size();
        if (const auto [stop, error] = std::from_chars(value.data(), end, number); error != std::errc() || stop != end)
            throw std::runtime_error("--" + key + " needs an integer, not '" + value + "'");
        return number;
    }

private:
    std::map<std::string, std::string> values;
};

struct Job {
    std::string folder, out, kind, precision;
    int width = 0, height = 0;
    int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  // CAM-5
    int depth, threads, frames;
    bool shadows;
    double sample_x, sample_y, epsilon;
    std::vector<std::string> needs;

    explicit Job(const Flags& flags)
        : folder(flags.folder("job")), out(flags.folder("out")), kind(flags.text("kind", "image")),
          precision(flags.text("precision", "float64")), depth(flags.integer("depth", 0, 0)),
          threads(flags.text("variant") == "cpp" ? 1 : flags.integer("threads", 1, 1)),
          frames(flags.integer("frames", 0, 0)), shadows(flags.integer("shadows", 0, 0) != 0),
          sample_x(flags.fraction("sample_x", 0.5)), sample_y(flags.fraction("sample_y", 0.5)),
          epsilon(flags.fraction("epsilon", 0x1p-48)), needs(flags.list("needs"))
    {
        if (kind == "image")
            read_size(flags);
    }

    // Refuses a job that needs a feature or a method outside what this program has.
    void require(const std::vector<std::string>& features) const
    {
        for (const std::string& need : needs)
            if (std::find(features.begin(), features.end(), need) == features.end())
                throw Unsupported("does not support " + need);
        if (kind != "image" && kind != "rays")
            throw Unsupported("does not support a job of kind '" + kind + "'");
        if (precision != "float64" && precision != "float32")
            throw Unsupported("does not support precision '" + precision + "'");
    }

private:
    void read_size(const Flags& flags)
    {
        width = x1 = flags.integer("width", 1, 0);
        height = y1 = flags.integer("height", 1, 0);
        const std::vector<std::string> edges = flags.list("region");
        if (edges.empty())
            return;
        int* region[] = {&x0, &y0, &x1, &y1};
        for (std::size_t i = 0; i < 4 && edges.size() == 4; i++)
            *region[i] = Flags::to_integer("region", edges[i]);
        if (edges.size() != 4 || x0 < 0 || y0 < 0 || x0 > x1 || y0 > y1 || x1 > width || y1 > height)
            throw std::runtime_error("--region must be x0,y0,x1,y1 inside the picture, not " + flags.text("region"));
    }
};
