// What the program says: one JSON object a line, and the numbers in it.
#pragma once
#include <algorithm>
#include <chrono>
#include <concepts>
#include <cstdio>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <utility>

// Seconds on the system's monotonic clock.
inline double now()
{
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

inline std::string json(double seconds)
{
    char text[64];
    std::snprintf(text, sizeof text, "%.9f", seconds);
    return text;
}

// A number with all its digits.
inline std::string exact(double number)
{
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", number);
    return text;
}

template<std::integral Integer>
std::string json(Integer count)
{
    return std::to_string(count);
}

inline std::string json(const std::string& text)
{
    std::string quoted = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\')
            quoted += '\\', quoted += c;
        else if ((unsigned char)c < 0x20) {
            char escape[8];
            std::snprintf(escape, sizeof escape, "\\u%04x", (unsigned)c);
            quoted += escape;
        } else
            quoted += c;
    }
    return quoted + '"';
}

// Prints an event; every value is JSON already. Flushed at once: what was said before a crash is not lost.
inline void say(const char* event, std::initializer_list<std::pair<const char*, std::string>> values)
{
    std::string line = "{\"event\": " + json(event);
    for (const auto& [key, value] : values)
        line += ", " + json(key) + ": " + value;
    std::printf("%s}\n", line.c_str());
    std::fflush(stdout);
}

// Phases follow each other without a gap: one begins where the one before it ended, the first before main().
inline double phase_start = now();

inline void say_phase(const char* name)
{
    const double end = now();
    say("phase", {{"name", json(name)}, {"start", json(phase_start)}, {"end", json(end)}});
    phase_start = end;
}

// The process's peak memory. Where there is no /proc (anything but Linux) it is unknown, and null is said.
class Memory {
public:
    // Puts the peak back to what is resident now (proc(5), clear_refs 5).
    Memory() : before(status("VmHWM"))
    {
        std::FILE* clear = std::fopen("/proc/self/clear_refs", "w");
        reset = clear && std::fputc('5', clear) != EOF;
        reset = clear && std::fclose(clear) == 0 && reset;
    }

    void say_peaks() const
    {
        const long long after = status("VmHWM");
        say("memory", {{"peak_bytes", known(std::max(before, after))},
                       {"render_peak_bytes", known(reset ? after : -1)},
                       {"peak_virtual_bytes", known(status("VmPeak"))},
                       {"method", after < 0 ? "null" : "\"VmHWM\""}});
    }

private:
    long long before;
    bool reset;

    // A line of /proc/self/status in bytes, or -1.
    static long long status(const std::string& key)
    {
        std::FILE* file = std::fopen("/proc/self/status", "r");
        long long bytes = -1;
        for (char line[256]; file && std::fgets(line, sizeof line, file);)
            if (std::string(line).compare(0, key.size() + 1, key + ":") == 0)
                bytes = std::atoll(line + key.size() + 1) * 1024;
        if (file)
            std::fclose(file);
        return bytes;
    }

    static std::string known(long long bytes) { return bytes < 0 ? "null" : json(bytes); }
};
