// The arrays of a job's folder, as the contract lists them, and checked: what is here can be indexed without care.
#pragma once
#include "../job/npy.hpp"

struct Scene {
    Array<double> camera, ambient, background, air, lights, materials;
    Array<double> spheres, boxes, polygon_vertices, ellipsoids, mesh_vertices, csg_spheres, csg_boxes, csg_ellipsoids;
    Array<std::int32_t> polygon_ranges, mesh_triangles, mesh_ranges, csg_meshes, csg_code, csg_ranges;
    Array<std::int32_t> sphere_ids, box_ids, polygon_ids, ellipsoid_ids, mesh_ids, csg_ids, media;
    Array<std::int32_t> precedence;
    Array<std::uint32_t> sobol;  // SOB-2
};

[[noreturn]] inline void fail_scene(const char* name, const std::string& reason)
{
    throw std::runtime_error(name + (".npy: " + reason));
}

inline void check_shape(bool right, const char* name, const std::string& wanted)
{
    if (!right)
        fail_scene(name, "the shape must be " + wanted);
}

// Reads an array of shape (any, columns).
template<typename T>
void read_table(const std::string& folder, const char* name, std::size_t columns, Array<T>& table)
{
    read_npy(folder + "/" + name + ".npy", table);
    check_shape(table.shape.size() == 2 && table.shape[1] == columns, name, "(n, " + std::to_string(columns) + ")");
}

// Reads an array of shape (count,).
inline void read_list(const std::string& folder, const char* name, std::size_t count, Array<double>& list)
{
    read_npy(folder + "/" + name + ".npy", list);
    check_shape(list.shape == std::vector{count}, name, "(" + std::to_string(count) + ",)");
}

// Fails unless the first two columns of every row are a range of at least `least` of `count` things.
inline void check_ranges(const Array<std::int32_t>& ranges, int least, std::size_t count, const char* name)
{
    for (std::size_t i = 0; i < ranges.rows(); i++) {
        const std::int64_t first = ranges.row(i)[0], length = ranges.row(i)[1];
        if (first < 0 || length < least || first + length > std::int64_t(count))
            fail_scene(name, "row " + std::to_string(i) + " is no range of " + std::to_string(least) +
                                 " or more of the " + std::to_string(count) + " there are");
    }
}

inline void check_row(std::int32_t row, std::size_t rows, const char* name)
{
    if (row < 0 || std::size_t(row) >= rows)
        fail_scene(name, "there is no row " + std::to_string(row) + " to refer to");
}

// One row for every shape, and its material a row of materials.npy.
inline void check_ids(const Array<std::int32_t>& ids, std::size_t shapes, std::size_t materials, const char* name)
{
    if (ids.rows() != shapes)
        fail_scene(name, "one row is needed for every shape");
    for (std::size_t i = 0; i < ids.rows(); i++)
        check_row(ids.row(i)[1], materials, name);
}

// Every solid is an expression of one value over parts that are there.
inline void check_csg(const Scene& scene)
{
    const std::size_t parts[] = {scene.csg_spheres.rows(), scene.csg_boxes.rows(), scene.csg_ellipsoids.rows(),
                                 scene.csg_meshes.rows()};
    check_ranges(scene.csg_meshes, 1, scene.mesh_triangles.rows(), "csg_meshes");
    check_ranges(scene.csg_ranges, 1, scene.csg_code.rows(), "csg_ranges");
    for (std::size_t i = 0; i < scene.csg_ranges.rows(); i++) {
        const std::int32_t *range = scene.csg_ranges.row(i), *step = scene.csg_code.row(std::size_t(range[0]));
        int values = 0;
        for (int k = 0; k < range[1]; k++, step += 2) {
            if (step[0] < 0 || step[0] > 6 || values < (step[0] == 6 ? 1 : step[0] >= 4 ? 2 : 0))
                fail_scene("csg_code", "no postfix of OR, AND and NOT");
            if (step[0] < 4)
                check_row(step[1], parts[step[0]], "csg_code");
            values += step[0] < 4 ? 1 : step[0] < 6 ? -1 : 0;
        }
        if (values != 1)
            fail_scene("csg_code", "a solid leaves " + std::to_string(values) + " values, not 1");
    }
}

inline void check_scene(const Scene& scene)
{
    check_shape(scene.camera.rows() == 4, "camera", "(4, 3)");
    check_ranges(scene.polygon_ranges, 3, scene.polygon_vertices.rows(), "polygon_ranges");
    check_ranges(scene.mesh_ranges, 0, scene.mesh_triangles.rows(), "mesh_ranges");
    for (std::size_t i = 0; i < scene.mesh_triangles.rows(); i++)
        for (int k = 0; k < 3; k++)
            check_row(scene.mesh_triangles.row(i)[k], scene.mesh_vertices.rows(), "mesh_triangles");
    check_csg(scene);

    const std::size_t materials = scene.materials.rows();
    check_ids(scene.sphere_ids, scene.spheres.rows(), materials, "sphere_ids");
    check_ids(scene.box_ids, scene.boxes.rows(), materials, "box_ids");
    check_ids(scene.polygon_ids, scene.polygon_ranges.rows(), materials, "polygon_ids");
    check_ids(scene.ellipsoid_ids, scene.ellipsoids.rows(), materials, "ellipsoid_ids");
    check_ids(scene.mesh_ids, scene.mesh_ranges.rows(), materials, "mesh_ids");
    check_ids(scene.csg_ids, scene.csg_ranges.rows(), materials, "csg_ids");
    if (!scene.precedence.data.empty())
        for (const Array<std::int32_t>* ids : {&scene.sphere_ids, &scene.box_ids, &scene.polygon_ids,
                                               &scene.ellipsoid_ids, &scene.mesh_ids, &scene.csg_ids})
            for (std::size_t i = 0; i < ids->rows(); i++)
                check_row(ids->row(i)[0], scene.precedence.data.size(), "precedence");
    check_ids(scene.media, scene.media.rows(), materials, "media");
    if (scene.media.rows() > 63)
        fail_scene("media", "63 solids can have a rank, not " + std::to_string(scene.media.rows()));
}

inline void read_scene(const std::string& folder, Scene& scene)
{
    const struct {
        const char* name;
        std::size_t columns;
        Array<double>& table;
    } numbers[] = {
        {"camera", 3, scene.camera},
        {"lights", 7, scene.lights},
        {"materials", 11, scene.materials},
        {"spheres", 4, scene.spheres},
        {"boxes", 12, scene.boxes},
        {"polygon_vertices", 3, scene.polygon_vertices},
        {"ellipsoids", 12, scene.ellipsoids},
        {"mesh_vertices", 3, scene.mesh_vertices},
        {"csg_spheres", 4, scene.csg_spheres},
        {"csg_boxes", 12, scene.csg_boxes},
        {"csg_ellipsoids", 12, scene.csg_ellipsoids},
    };
    const struct {
        const char* name;
        std::size_t columns;
        Array<std::int32_t>& table;
    } integers[] = {
        {"polygon_ranges", 2, scene.polygon_ranges},
        {"mesh_triangles", 3, scene.mesh_triangles},
        {"mesh_ranges", 3, scene.mesh_ranges},
        {"csg_meshes", 2, scene.csg_meshes},
        {"csg_code", 2, scene.csg_code},
        {"csg_ranges", 2, scene.csg_ranges},
        {"sphere_ids", 2, scene.sphere_ids},
        {"box_ids", 2, scene.box_ids},
        {"polygon_ids", 2, scene.polygon_ids},
        {"ellipsoid_ids", 2, scene.ellipsoid_ids},
        {"mesh_ids", 2, scene.mesh_ids},
        {"csg_ids", 2, scene.csg_ids},
        {"media", 3, scene.media},
    };
    for (const auto& [name, columns, table] : numbers)
        read_table(folder, name, columns, table);
    for (const auto& [name, columns, table] : integers)
        read_table(folder, name, columns, table);
    read_list(folder, "ambient", 3, scene.ambient);
    read_list(folder, "background", 3, scene.background);
    read_list(folder, "air", 5, scene.air);
    read_npy(folder + "/precedence.npy", scene.precedence);
    if constexpr (needs::sobol) {
        read_npy(folder + "/sobol.npy", scene.sobol);
        check_shape(scene.sobol.shape.size() == 2 && scene.sobol.shape[1] == 32, "sobol", "(n, 32)");
    }
    check_scene(scene);
}
