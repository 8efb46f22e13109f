// Arrays in files: NumPy's .npy, format version 1.0, little endian, C order.
#pragma once
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

static_assert(std::endian::native == std::endian::little, "the files are little endian and are read as they are");

template<typename T> constexpr const char* dtype = nullptr;
template<> constexpr const char* dtype<double> = "<f8";
template<> constexpr const char* dtype<float> = "<f4";
template<> constexpr const char* dtype<std::int32_t> = "<i4";
template<> constexpr const char* dtype<std::uint32_t> = "<u4";

template<typename T>
struct Array {
    std::vector<std::size_t> shape;
    std::vector<T> data;

    std::size_t rows() const { return shape[0]; }
    const T* row(std::size_t i) const { return data.data() + i * (data.size() / shape[0]); }
};

// The text behind 'key': in the header, which is a Python dictionary.
inline std::string npy_entry(const std::string& header, const std::string& key)
{
    const std::string name = "'" + key + "': ";
    const std::size_t at = header.find(name);
    return at == std::string::npos ? "" : header.substr(at + name.size());
}

struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, CloseFile>;

[[noreturn]] inline void fail_npy(const std::string& path, const std::string& reason)
{
    throw std::runtime_error(path + ": " + reason);
}

// Opens a file whose data have this dtype, reads its header and stops where the data begin. Returns how many there are.
inline std::size_t open_npy(const std::string& path, const std::string& wanted, std::size_t item_size, File& file,
                            std::vector<std::size_t>& dimensions)
{
    file.reset(std::fopen(path.c_str(), "rb"));
    if (!file)
        fail_npy(path, "cannot be opened");
    char magic[10] = {};
    if (std::fread(magic, 1, sizeof magic, file.get()) != sizeof magic || std::memcmp(magic, "\x93NUMPY\x01", 8) != 0)
        fail_npy(path, "is not a .npy file of version 1.0");
    std::string header(std::size_t((unsigned char)magic[8] + 256 * (unsigned char)magic[9]), ' ');
    if (std::fread(header.data(), 1, header.size(), file.get()) != header.size())
        fail_npy(path, "ends in its header");

    const std::string descr = npy_entry(header, "descr"), order = npy_entry(header, "fortran_order");
    const std::string shape = npy_entry(header, "shape");
    if (descr.compare(0, 5, "'" + wanted + "'") != 0)
        fail_npy(path, "holds " + descr.substr(0, descr.find(',')) + ", not '" + wanted + "'");
    if (order.compare(0, 5, "False") != 0)
        fail_npy(path, "is not in C order");

    std::size_t count = 1;
    for (std::size_t at = 1; at < shape.size() && shape[at] != ')'; at = shape.find_first_not_of(", ", at)) {
        std::size_t n = 0;
        const auto [stop, error] = std::from_chars(&shape[at], shape.data() + shape.size(), n);
        if (error != std::errc())
            fail_npy(path, "has a broken shape");
        dimensions.push_back(n);
        count *= n;
        at = std::size_t(stop - shape.data());
    }

    const long start = std::ftell(file.get());
    std::fseek(file.get(), 0, SEEK_END);
    if (std::size_t(std::ftell(file.get()) - start) != count * item_size)
        fail_npy(path, "has not the length that its shape asks for");
    std::fseek(file.get(), start, SEEK_SET);
    return count;
}

template<typename T>
void read_npy(const std::string& path, Array<T>& array)
{
    File file;
    array.data.resize(open_npy(path, dtype<T>, sizeof(T), file, array.shape));
    if (std::fread(array.data.data(), sizeof(T), array.data.size(), file.get()) != array.data.size())
        fail_npy(path, "cannot be read");
}

inline void write_npy(const std::string& path, std::initializer_list<std::size_t> shape, const char* dtype,
                      const void* data, std::size_t bytes)
{
    std::string header = std::string("{'descr': '") + dtype + "', 'fortran_order': False, 'shape': (";
    for (std::size_t n : shape)
        header += std::to_string(n) + ", ";
    header += "), }";
    header.append(63 - (10 + header.size()) % 64, ' ');  // the data start at a multiple of 64 bytes
    header += '\n';
    const unsigned char start[] = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0, (unsigned char)(header.size() % 256),
                                   (unsigned char)(header.size() / 256)};

    File file(std::fopen(path.c_str(), "wb"));
    const bool written = file && std::fwrite(start, 1, sizeof start, file.get()) == sizeof start &&
                         std::fwrite(header.data(), 1, header.size(), file.get()) == header.size() &&
                         std::fwrite(data, 1, bytes, file.get()) == bytes;
    if (!written || std::fclose(file.release()) != 0)
        fail_npy(path, "cannot be written");
}

template<typename T>
void write_npy(const std::string& path, std::initializer_list<std::size_t> shape, const std::vector<T>& data)
{
    write_npy(path, shape, dtype<T>, data.data(), data.size() * sizeof(T));
}
