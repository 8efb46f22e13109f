// The arrays of a job's folder, as the contract lists them, and checked: what is here can be indexed without care.
#pragma once
#include "npy.hpp"

struct Scene {
    Array<double> camera, ambient, background, air, lights, materials, spheres, boxes, polygon_vertices, ellipsoids;
    Array<std::int32_t> polygon_ranges, sphere_ids, box_ids, polygon_ids, ellipsoid_ids;
};

// Reads an array of shape (any, columns).
template<typename T>
Array<T> read_table(const std::string& folder, const std::string& name, std::size_t columns)
{
    Array<T> table = read_npy<T>(folder + "/" + name + ".npy");
    if (table.shape.size() != 2 || table.shape[1] != columns)
        throw std::runtime_error(name + ".npy: the shape must be (n, " + std::to_string(columns) + ")");
    return table;
}

// Reads an array of shape (count,).
inline Array<double> read_list(const std::string& folder, const std::string& name, std::size_t count)
{
    Array<double> list = read_npy<double>(folder + "/" + name + ".npy");
    if (list.shape != std::vector{count})
        throw std::runtime_error(name + ".npy: the shape must be (" + std::to_string(count) + ",)");
    return list;
}

inline void check_ids(const Array<std::int32_t>& ids, std::size_t shapes, std::size_t materials, const std::string& name)
{
    if (ids.rows() != shapes)
        throw std::runtime_error(name + ".npy: one row is needed for every shape");
    for (std::size_t i = 0; i < ids.rows(); i++)
        if (const int material = ids.row(i)[1]; material < 0 || std::size_t(material) >= materials)
            throw std::runtime_error(name + ".npy: there is no material " + std::to_string(material));
}

inline Scene read_scene(const std::string& folder)
{
    Scene scene{
        .camera = read_table<double>(folder, "camera", 3),
        .ambient = read_list(folder, "ambient", 3),
        .background = read_list(folder, "background", 3),
        .air = read_list(folder, "air", 5),
        .lights = read_table<double>(folder, "lights", 7),
        .materials = read_table<double>(folder, "materials", 11),
        .spheres = read_table<double>(folder, "spheres", 4),
        .boxes = read_table<double>(folder, "boxes", 12),
        .polygon_vertices = read_table<double>(folder, "polygon_vertices", 3),
        .ellipsoids = read_table<double>(folder, "ellipsoids", 12),
        .polygon_ranges = read_table<std::int32_t>(folder, "polygon_ranges", 2),
        .sphere_ids = read_table<std::int32_t>(folder, "sphere_ids", 2),
        .box_ids = read_table<std::int32_t>(folder, "box_ids", 2),
        .polygon_ids = read_table<std::int32_t>(folder, "polygon_ids", 2),
        .ellipsoid_ids = read_table<std::int32_t>(folder, "ellipsoid_ids", 2),
    };

    if (scene.camera.rows() != 4)
        throw std::runtime_error("camera.npy: the shape must be (4, 3)");
    for (std::size_t i = 0; i < scene.polygon_ranges.rows(); i++) {
        const std::int64_t first = scene.polygon_ranges.row(i)[0], count = scene.polygon_ranges.row(i)[1];
        if (first < 0 || count < 3 || first + count > std::int64_t(scene.polygon_vertices.rows()))
            throw std::runtime_error("polygon_ranges.npy: row " + std::to_string(i) + " is no range of 3 or more vertices");
    }
    const std::size_t materials = scene.materials.rows();
    check_ids(scene.sphere_ids, scene.spheres.rows(), materials, "sphere_ids");
    check_ids(scene.box_ids, scene.boxes.rows(), materials, "box_ids");
    check_ids(scene.polygon_ids, scene.polygon_ranges.rows(), materials, "polygon_ids");
    check_ids(scene.ellipsoid_ids, scene.ellipsoids.rows(), materials, "ellipsoid_ids");
    return scene;
}
