// The scene as the host lays it out (load.py): one table of numbers of the job's precision, one of integers, and where
// in them is what.

// Names without _at are numbers of things or parameters of the job; names with it the first of their numbers or
// integers. The host reads this list.
typedef struct {
    int width, height, x0, y0, x1, y1;                                 // of the whole picture; the region
    int depth, shadows, feelers, glossy_rays, study_weight, seed;      // of the job
    int sampler, samples, row_length, levels, lens;                    // sampler: of the list below; row: of SAM-3
    int sobol_at, first_light, each_order, light_dimensions;           // of SOB-1 and SOB-2
    int rows, table_base;                                              // of the walk; children of a row of the table
    int lights, lights_at, materials_at, air, media_at, eye_low, eye_high;  // air: the row of AIR among the materials
    int shapes, roles_at;
    int spheres, spheres_at, boxes, boxes_at;
    int polygons, polygons_at, polygon_ranges_at, corners_at;
    int ellipsoids, ellipsoids_at, triangles, triangles_at;
    int solids, solids_at, code_at, part_spheres_at, part_boxes_at, part_ellipsoids_at;
    int part_meshes_at, part_triangles_at;
    int touching, precedence_at, extents_at;                           // of MED-6; the last extent is the largest
    int tree_at, links_at, items_at, in_tree, loose, loose_at, roots_at;
} Layout;

enum { ONE, UNIFORM, JITTERED, ADAPTIVE, SOBOL };  // samplers

// Numbers at the start of the table.
enum {
    EYE = 0, U = 3, V = 6, E = 9, LENS_U = 12, LENS_V = 15, AMBIENT = 18, BACKGROUND = 21,
    SAMPLE = 24, FOCUS = 26, EPSILON_OF_RAYS = 27, SLIVER = 28, CUTOFF = 29, THRESHOLD = 30
};

// Columns of the tables, and how many there are.
enum { LIGHT = 7, MATERIAL = 12 + NEED_GLOSSY, SPHERE = 4, BOX = 31, POLYGON = 4, CORNER = 6, ELLIPSOID = 22, TRIANGLE = 14, NODE = 6 };
enum { DIFFUSE = 0, SPECULAR = 3, EXPONENT = 4, INDEX = 5, MU = 6, ATTENUATION = 7, ATTENUATES = 10, CLEAR = 11, LOBE = 12 };
enum { OBJECT, MATERIAL_ROW, RANK, FLAT, ROLE };  // of a shape, integers; RANK: of MED-2 or -1, FLAT: of MED-4

typedef struct {
    SCENE const real *numbers;
    SCENE const int *integers;
    Layout at;
#if STREAMED
    SHARED real *tile;  // these two are the group's: shapes that all its threads try, and a vote of its threads (search.h)
    SHARED int *vote;
#endif
} Scene;

DEVICE real number(const Scene *scene, int which) { return scene->numbers[which]; }
DEVICE real3 triple(const Scene *scene, int which) { return LOAD3(scene->numbers + which); }
