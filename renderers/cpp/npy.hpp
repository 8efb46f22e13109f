// Arrays in files: NumPy's .npy, format version 1.0, little endian, C order.
#pragma once
#include <bit>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <vector>

static_assert(std::endian::native == std::endian::little, "the files are little endian and are read as they are");

template<typename T> constexpr const char* dtype = nullptr;
template<> constexpr const char* dtype<double> = "<f8";
template<> constexpr const char* dtype<float> = "<f4";
template<> constexpr const char* dtype<std::int32_t> = "<i4";

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

template<typename T>
Array<T> read_npy(const std::string& path)
{
    auto fail = [&](const std::string& reason) { throw std::runtime_error(path + ": " + reason); };

    std::ifstream file(path, std::ios::binary);
    if (!file)
        fail("cannot be opened");
    char magic[10] = {};
    file.read(magic, sizeof magic);
    if (!file || std::string(magic, 8) != std::string("\x93NUMPY\x01\x00", 8))
        fail("is not a .npy file of version 1.0");
    std::string header(std::size_t((unsigned char)magic[8] + 256 * (unsigned char)magic[9]), ' ');
    file.read(header.data(), std::streamsize(header.size()));

    if (!file)
        fail("ends in its header");

    const std::string descr = npy_entry(header, "descr"), order = npy_entry(header, "fortran_order");
    const std::string shape = npy_entry(header, "shape");
    if (descr.compare(0, 5, "'" + std::string(dtype<T>) + "'") != 0)
        fail("holds " + descr.substr(0, descr.find(',')) + ", not '" + dtype<T> + "'");
    if (order.compare(0, 5, "False") != 0)
        fail("is not in C order");

    Array<T> array;
    std::size_t count = 1;
    for (std::size_t at = 1; at < shape.size() && shape[at] != ')'; at = shape.find_first_not_of(", ", at)) {
        std::size_t n = 0;
        const auto [stop, error] = std::from_chars(&shape[at], shape.data() + shape.size(), n);
        if (error != std::errc())
            fail("has a broken shape");
        array.shape.push_back(n);
        count *= n;
        at = std::size_t(stop - shape.data());
    }

    const std::streamoff start = file.tellg();
    file.seekg(0, std::ios::end);
    if (std::size_t(file.tellg() - start) != count * sizeof(T))
        fail("has not the length that its shape asks for");
    file.seekg(start);
    array.data.resize(count);
    file.read(reinterpret_cast<char*>(array.data.data()), std::streamsize(count * sizeof(T)));
    if (!file)
        fail("cannot be read");
    return array;
}

template<typename T>
void write_npy(const std::string& path, std::initializer_list<std::size_t> shape, const std::vector<T>& data)
{
    std::string header = std::string("{'descr': '") + dtype<T> + "', 'fortran_order': False, 'shape': (";
    for (std::size_t n : shape)
        header += std::to_string(n) + ", ";
    header += "), }";
    header.append(63 - (10 + header.size()) % 64, ' ');  // the data start at a multiple of 64 bytes
    header += '\n';

    std::ofstream file(path, std::ios::binary);
    file.write("\x93NUMPY\x01\x00", 8);
    file.put(char(header.size() % 256)).put(char(header.size() / 256));
    file << header;
    file.write(reinterpret_cast<const char*>(data.data()), std::streamsize(data.size() * sizeof(T)));
    file.close();
    if (!file)
        throw std::runtime_error(path + ": cannot be written");
}
