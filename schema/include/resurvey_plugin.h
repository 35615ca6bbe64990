/* resurvey plugin line, version 1.1.
 *
 * A plugin is a shared library with ONE exported data symbol, an rsv_declaration. The host reads its first bytes from
 * the file before any code of the plugin runs, opens the library, calls `entry` once, and then the functions that entry
 * put into the table. Whole plugins: plugins/fixtures/c/matcher.c in 60 lines, examples/c_detector/detector.c, and in
 * C++ examples/cpp_matcher/matcher.cpp. plugins/README.md is the first hour, docs/plugin-guide.md the prose.
 *
 * Rules of the line
 *  1. Structs that begin with `size` may grow at their end. Whoever makes one writes sizeof into `size`; whoever reads
 *     one looks at no field beyond `size` (RSV_HAS asks). What is not known reads as zero or null. All other structs
 *     are frozen.
 *  2. Whatever comes in is lent for the length of the call, and read-only unless it is named as a place for an answer.
 *     Keep no pointer to it. Nobody frees what the other side allocated.
 *  3. An instance is never called from two threads at once, but may move between threads. `create` may be called from
 *     several threads at once. Services may be called from any thread until the call returns, not after.
 *  4. No exception, longjmp or signal may leave a function of the plugin. A library must not call exit, change the
 *     working directory, the locale, the floating-point mode or signal handlers, nor write to stdout.
 *  5. Every function returns an RSV_ status. With anything but RSV_OK, write a sentence into `error`: what was expected,
 *     what was found. It is shown to the user. rsv_fail() below does both.
 *  6. Answers are checked by the host: one bad value drops the whole run.
 *  7. When `cancelled` returns 1, return RSV_CANCELLED within 200 ms.
 *
 * Numbers: metres and radians. A position is easting, northing, height in the system of the map (HK1980 Grid and HKPD
 * unless the map says otherwise). A pose is position and yaw (clockwise from grid north), pitch (up), roll (right side
 * down). Images are row-major, top-left first; pixel (i, j) has its centre at (i + 0.5, j + 0.5). Camera axes: x right,
 * y down, z forward. Class 255 is void: unlabelled, never compared.
 */
#ifndef RESURVEY_PLUGIN_H
#define RESURVEY_PLUGIN_H

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

#define RSV_ABI_MAJOR 1
#define RSV_ABI_MINOR 1 /* 1: segmenters */

/* Every function of the line uses the C calling convention of the platform. */
#ifdef _WIN32
#define RSV_EXPORT __declspec(dllexport)
#else
#define RSV_EXPORT __attribute__((visibility("default")))
#endif

typedef int32_t rsv_status;
#define RSV_OK 0
#define RSV_FAILED 1      /* there is no answer */
#define RSV_PANICKED 2    /* a bug in the callee; the host ends the instance and does not call it again */
#define RSV_CANCELLED 3   /* ended early because the host asked for it */
#define RSV_UNSUPPORTED 4 /* the callee does not do this, or not for these arguments */

/* Kinds of plugin. 5 is kept for positioners (a better prior). */
#define RSV_KIND_MATCHER 1
#define RSV_KIND_DETECTOR 2
#define RSV_KIND_ESTIMATOR 3
#define RSV_KIND_SEGMENTER 4

/* Kinds of class, models of camera, levels of the log, and the class of a pixel that is not labelled. */
#define RSV_CLASS_MATERIAL 0
#define RSV_CLASS_DYNAMIC 1
#define RSV_CLASS_IGNORED 2
#define RSV_CAMERA_PINHOLE 0
#define RSV_CAMERA_BROWN 1   /* k1 k2 p1 p2 k3, in OpenCV's order */
#define RSV_CAMERA_FISHEYE 2 /* k1 k2 k3 k4, in OpenCV's order */
#define RSV_LOG_WARNING 0
#define RSV_LOG_INFO 1
#define RSV_LOG_DEBUG 2
#define RSV_VOID 255

/* ---- frozen records ------------------------------------------------------------------------------------------------ */

/* UTF-8 without a terminator; data may be null when length is 0. */
typedef struct rsv_text {
  const char *data;
  size_t length;
} rsv_text;

/* The type of the values is given where an image stands. data is aligned for it; row_bytes is at least one row and a
 * multiple of the value's size: rows may be padded. */
typedef struct rsv_image {
  const void *data;
  uint32_t width;
  uint32_t height;
  size_t row_bytes;
} rsv_image;

/* A place of the host for one class per pixel, of the photo's size: 255 everywhere when the call begins. Write to the
 * pixels alone: rows may be padded. */
typedef struct rsv_labels {
  uint8_t *data;
  uint32_t width;
  uint32_t height;
  size_t row_bytes;
} rsv_labels;

typedef struct rsv_point {
  double easting_m, northing_m, height_m;
} rsv_point;

typedef struct rsv_pose {
  rsv_point position;
  double yaw_rad, pitch_rad, roll_rad;
} rsv_pose;

typedef struct rsv_wgs84 {
  double latitude_deg, longitude_deg, ellipsoidal_height_m;
} rsv_wgs84;

typedef struct rsv_class {
  rsv_text name;
  double size_m[3]; /* along, across, up; zero unless dynamic */
  uint8_t index;    /* value in label images */
  uint8_t kind;     /* RSV_CLASS_ */
  uint8_t colour[3];
  uint8_t reserved[3];
} rsv_class;

/* A descriptor that can be seen in a view. */
typedef struct rsv_view_feature {
  uint64_t fid;
  uint8_t class_index; /* seven bytes of padding follow: do not read them */
} rsv_view_feature;

/* Counts of one class over the compared pixels of one view. */
typedef struct rsv_class_counts {
  uint32_t photo;                  /* pixels of the class in the photo */
  uint32_t view;                   /* in the view */
  uint32_t both;                   /* in both */
  uint32_t photo_boundary;         /* boundary pixels in the photo */
  uint32_t photo_boundary_matched; /* of these, with one of the view within the tolerance */
  uint32_t view_boundary;          /* boundary pixels in the view */
  uint32_t view_boundary_matched;  /* of these, with one of the photo within the tolerance */
} rsv_class_counts;

typedef struct rsv_ray_hit {
  rsv_point point;
  double range_m;   /* along the ray */
  double normal[3]; /* unit, turned towards the origin of the ray */
  uint64_t fid;     /* where has_fid */
  uint8_t hit;      /* 0: nothing within the limit, the rest is zero */
  uint8_t has_fid;  /* 1: a descriptor, 0: the base map */
  uint8_t class_index;
  uint8_t reserved[5];
} rsv_ray_hit;

/* ---- what goes into a call ----------------------------------------------------------------------------------------- */

/* A buffer of the caller for the text of an error: write at most capacity bytes of UTF-8 to data and their number to
 * length. The pointer to it may be null. */
typedef struct rsv_error {
  uint32_t size;
  uint32_t capacity;
  uint32_t length;
  uint32_t reserved;
  char *data;
} rsv_error;

typedef struct rsv_host_info {
  uint32_t size;
  uint16_t abi_major, abi_minor; /* what the host speaks */
  rsv_text version;              /* of the program, for messages alone */
} rsv_host_info;

typedef struct rsv_camera {
  uint32_t size;
  uint32_t model;       /* RSV_CAMERA_ */
  uint32_t width, height;
  double fx, fy, cx, cy; /* pixels */
  double distortion[5];
} rsv_camera;

/* The phone's rough pose, 1 sigma each. */
typedef struct rsv_prior {
  uint32_t size;
  uint32_t reserved;
  rsv_pose pose;
  double position_sigma_m, height_sigma_m, yaw_sigma_rad, tilt_sigma_rad;
} rsv_prior;

typedef struct rsv_pose_estimate {
  uint32_t size;
  uint32_t reserved;
  rsv_pose pose;
  double covariance[9]; /* row-major over easting, northing, yaw */
  double height_sigma_m, tilt_sigma_rad;
  uint32_t has_alignment;            /* 1: the fields below count */
  uint32_t reserved_2;
  double alignment_covariance[21];   /* over easting, northing, yaw, height, pitch, roll: lower triangle, row by row */
  double map_sigma_m;                /* by which walls stand off the map */
  double label_sigma_px;             /* by which contours of the labels wander */
} rsv_pose_estimate;

/* The map as seen from a pose. All four images have one size. */
typedef struct rsv_view {
  uint32_t size;
  uint32_t reserved;
  rsv_point origin;   /* where the offsets in points start */
  rsv_image labels;   /* uint8_t: class; sky where nothing is hit */
  rsv_image range_m;  /* float: distance along the ray; infinite where nothing is hit */
  rsv_image points;   /* float[3]: offset from origin; NaN where nothing is hit */
  rsv_image features; /* uint32_t: 0, or 1 + index into feature_table */
  const rsv_view_feature *feature_table;
  size_t feature_count;
} rsv_view;

typedef struct rsv_photo {
  uint32_t size;
  uint32_t reserved;
  rsv_image labels; /* uint8_t: class */
  const rsv_camera *camera;
  const rsv_prior *prior;
} rsv_photo;

/* What a segmenter sees: the photo, upright and of the camera's size. */
typedef struct rsv_picture {
  uint32_t size;
  uint32_t reserved;
  rsv_image pixels; /* uint8_t[3]: red, green, blue (sRGB); row_bytes is a multiple of 3 */
} rsv_picture;

/* Photo and view of the same pose, of one size. */
typedef struct rsv_comparison {
  uint32_t size;
  uint32_t reserved;
  rsv_image photo; /* uint8_t: class */
  const rsv_view *view;
  const rsv_camera *camera;
  const rsv_pose_estimate *estimate;
} rsv_comparison;

typedef struct rsv_render_request {
  uint32_t size;
  uint32_t stride;           /* every so many pixels; at least 1 */
  uint32_t with_descriptors; /* 1: descriptors are placed on the map */
  uint32_t reserved;
} rsv_render_request;

/* Class c is in a set of classes when bit c % 64 of word c / 64 is 1. */
typedef struct rsv_compare_request {
  uint32_t size;
  uint32_t stride;              /* every so many pixels; at least 1 */
  uint64_t ignored_in_photo[4]; /* a pixel whose photo class is in here, or void, is not compared */
  uint64_t ignored_in_view[4];
  double boundary_tolerance_px; /* full-size pixels; 0 leaves the boundary counts out */
} rsv_compare_request;

typedef struct rsv_panorama_request {
  uint32_t size;
  uint32_t columns;          /* over the full circle */
  uint32_t yaw_step_columns; /* between neighbouring headings */
  uint32_t yaw_count;
  double first_yaw_rad; /* rounded to a whole column */
  double pitch_rad, roll_rad;
  uint64_t ignored_in_photo[4];
  uint64_t ignored_in_view[4];
} rsv_panorama_request;

/* ---- what comes out of a call -------------------------------------------------------------------------------------- */

/* The answer of a search, a place of the host: leave `size` alone. */
typedef struct rsv_localization {
  uint32_t size;
  uint32_t has_runner_up;
  rsv_pose pose;
  double score;                 /* 0 to 1 */
  double covariance[9];         /* row-major over easting, northing, yaw; symmetric */
  double runner_up_distance_m;  /* in plan */
  double runner_up_score_ratio; /* its likelihood over that of the pose, 0 to 1 */
  uint64_t candidates;          /* scored */
  uint64_t skipped;             /* left out: inside a solid building */
  uint32_t has_alignment;            /* 1: the fields below count */
  uint32_t reserved_2;
  double alignment_covariance[21];   /* over easting, northing, yaw, height, pitch, roll: lower triangle, row by row */
  double map_sigma_m;                /* by which walls stand off the map */
  double label_sigma_px;             /* by which contours of the labels wander */
} rsv_localization;

/* A region in which photo and view disagree; left <= u < right, top <= v < bottom. */
typedef struct rsv_region {
  uint32_t size;
  uint8_t class_before; /* in the view */
  uint8_t class_after;  /* in the photo */
  uint8_t reserved[2];
  uint32_t left, top, right, bottom;
  uint32_t pixels; /* number of ones in mask */
  uint32_t reserved_2;
  const uint8_t *mask; /* row-major over the box, no padding: 1 inside, 0 outside */
  size_t mask_length;  /* (right - left) * (bottom - top) */
} rsv_region;

#define RSV_MATERIAL 1
#define RSV_DYNAMIC 2
#define RSV_HAS_YAW 1
#define RSV_HAS_SIGMA 2
#define RSV_HAS_SIGMA_SIZE 4
#define RSV_HAS_SIGMA_AREA 8

typedef struct rsv_descriptor {
  uint32_t size;
  uint8_t kind; /* RSV_MATERIAL or RSV_DYNAMIC */
  uint8_t class_index;
  uint8_t has; /* RSV_HAS_ bits: which of the optional fields count */
  uint8_t reserved;
  double corners[4][3]; /* material: bottom-left, bottom-right, top-right, top-left, seen from outside */
  double normal[3];     /* material: unit, away from the surface */
  double position[3];   /* dynamic: ground contact */
  double size_m[3];     /* dynamic: along, across, up */
  double yaw_rad;       /* dynamic: RSV_HAS_YAW */
  double sigma_position_m, sigma_size_m, sigma_area_m2;
} rsv_descriptor;

#define RSV_PLACE 1
#define RSV_REMOVE 2
#define RSV_REJECT 3

typedef struct rsv_proposal {
  uint32_t size;
  uint32_t kind;                    /* RSV_PLACE, RSV_REMOVE or RSV_REJECT */
  uint32_t region;                  /* index of the region it comes from */
  uint32_t pixels;                  /* reject: size of the region */
  const rsv_descriptor *descriptor; /* place */
  double near_point[3];             /* remove: where it stood */
  double sigma_m;                   /* remove: 1 sigma of near_point */
  double measured, limit;           /* reject */
  rsv_text requirement;             /* reject: short stable name, such as "within-range" */
  rsv_text unit;                    /* reject: of measured and limit, such as "m" */
  uint8_t class_index;              /* remove: class in the view */
  uint8_t class_before, class_after; /* reject */
  uint8_t reserved[5];
} rsv_proposal;

/* Where results of unknown number go: call on the thread of the call, before it returns. The host copies at once. When
 * one does not return RSV_OK, return RSV_FAILED. */
typedef struct rsv_results {
  uint32_t size;
  uint32_t reserved;
  void *context; /* first argument of all three */
  rsv_status (*heat)(void *context, const double (*cells)[3], size_t count); /* easting m, northing m, score */
  rsv_status (*region)(void *context, const rsv_region *region);
  rsv_status (*proposal)(void *context, const rsv_proposal *proposal);
} rsv_results;

/* ---- what the host does for a plugin -------------------------------------------------------------------------------- */

typedef void (*rsv_view_receiver)(void *receiver, size_t index, const rsv_view *view);
typedef void (*rsv_feature_receiver)(void *receiver, uint64_t fid, const rsv_descriptor *descriptor);
typedef void (*rsv_task)(void *task, size_t index);

/* The photo and the camera are those of the call. A null function is a service that this host does not have. A segmenter
 * is called before anybody knows where the photo was taken: it has the class table, parallel_for, log, progress and
 * cancelled; every other service returns RSV_FAILED. */
typedef struct rsv_services {
  uint32_t size;
  uint32_t class_slots; /* one more than the highest class index: length of the counts of one view */
  void *context;        /* first argument of every service */
  const rsv_class *classes; /* by rising index */
  size_t class_count;

  /* One view per pose to receive, on this thread and in order; each is lent for that call alone. */
  rsv_status (*render)(void *context, const rsv_render_request *request, const rsv_pose *poses, size_t count,
                       void *receiver, rsv_view_receiver receive, rsv_error *error);
  /* Fills counts[count][class_slots]. */
  rsv_status (*compare_views)(void *context, const rsv_compare_request *request, const rsv_pose *poses, size_t count,
                              rsv_class_counts *counts, rsv_error *error);
  /* Fills counts[count][yaw_count][class_slots], which must be initialised memory; boundary counts are zero. */
  rsv_status (*compare_panoramas)(void *context, const rsv_panorama_request *request, const rsv_point *positions,
                                  size_t count, rsv_class_counts *counts, rsv_error *error);
  /* Fills inside[count]: 1 inside a solid building. */
  rsv_status (*inside_solid)(void *context, const rsv_point *positions, size_t count, uint8_t *inside,
                             rsv_error *error);
  /* Fills directions[count]: unit vectors through pixel coordinates u, v. */
  rsv_status (*pixel_rays)(void *context, const rsv_pose *pose, const double (*pixels)[2], size_t count,
                           double (*directions)[3], rsv_error *error);
  /* Fills pixels[count]; NaN behind the camera or outside the model. */
  rsv_status (*project)(void *context, const rsv_pose *pose, const rsv_point *points, size_t count,
                        double (*pixels)[2], rsv_error *error);
  /* Fills hits[count]: the first surface within limit_m. */
  rsv_status (*cast_rays)(void *context, const rsv_point *origin, const double (*directions)[3], size_t count,
                          double limit_m, uint32_t with_descriptors, rsv_ray_hit *hits, rsv_error *error);
  /* Descriptors whose anchor is within radius_m, to receive, on this thread and by rising fid. */
  rsv_status (*descriptors_near)(void *context, const rsv_point *point, double radius_m, void *receiver,
                                 rsv_feature_receiver receive, rsv_error *error);
  /* Height of the first surface of the base map below; NaN when there is none. */
  rsv_status (*ground_height)(void *context, const rsv_point *point, double *height_m, rsv_error *error);
  rsv_status (*grid_from_wgs84)(void *context, const rsv_wgs84 *position, rsv_point *point, rsv_error *error);
  rsv_status (*wgs84_from_grid)(void *context, const rsv_point *point, rsv_wgs84 *position, rsv_error *error);
  /* run(task, 0) to run(task, count - 1) on the host's threads, several at once; returns when all are done. */
  rsv_status (*parallel_for)(void *context, size_t count, void *task, rsv_task run, rsv_error *error);
  void (*log)(void *context, uint32_t level, rsv_text text); /* level: RSV_LOG_ */
  void (*progress)(void *context, double fraction);          /* 0 to 1 */
  uint32_t (*cancelled)(void *context);                      /* 1: return soon */
} rsv_services;

/* ---- the plugin ----------------------------------------------------------------------------------------------------- */

typedef struct rsv_instance rsv_instance; /* yours alone: the host never looks into it */

/* Filled by entry, into a place of the host that is zero but for `size`: leave `size` alone. A matcher needs score or
 * search (with both, the host searches), a detector detect, an estimator estimate, a segmenter segment; every plugin create
 * and destroy. */
typedef struct rsv_table {
  uint32_t size;
  uint32_t reserved;
  /* Flat JSON Schema: {"type": "object", "additionalProperties": false, "properties": {NAME: {"type": "number" |
   * "integer" | "boolean" | "string", "default": ..., "minimum", "maximum", "enum", "description"}, ...}}. Empty: no
   * settings. Lives as long as the library. */
  rsv_text settings_schema;
  /* settings is a JSON object with every setting of the schema, checked, sorted by name, written without spaces. With
   * anything but RSV_OK there is no instance: the host does not call destroy, whatever *instance is. */
  rsv_status (*create)(rsv_text settings, rsv_instance **instance, rsv_error *error);
  /* Once per instance; also after RSV_PANICKED. */
  void (*destroy)(rsv_instance *instance);
  /* Similarity of photo (uint8_t: class) and view, 0 to 1, higher is better; both have one size. */
  rsv_status (*score)(rsv_instance *instance, const rsv_image *photo, const rsv_view *view, double *score,
                      rsv_error *error);
  rsv_status (*search)(rsv_instance *instance, const rsv_services *services, const rsv_photo *photo,
                       const rsv_results *results, rsv_localization *found, rsv_error *error);
  rsv_status (*detect)(rsv_instance *instance, const rsv_services *services, const rsv_comparison *comparison,
                       const rsv_results *results, rsv_error *error);
  /* Region i is at (const char *)regions + i * region_step. */
  rsv_status (*estimate)(rsv_instance *instance, const rsv_services *services, const rsv_comparison *comparison,
                         const rsv_region *regions, size_t region_count, size_t region_step,
                         const rsv_results *results, rsv_error *error);
  /* Fills labels: each the index of a class of services->classes, or 255 where the pixel is none of them. */
  rsv_status (*segment)(rsv_instance *instance, const rsv_services *services, const rsv_picture *picture,
                        const rsv_labels *labels, rsv_error *error);
} rsv_table;

/* Frozen for every version of the line: 32 bytes without a pointer, read from the file. */
typedef struct rsv_header {
  char magic[8];           /* "RESURVEY", no terminator */
  uint16_t abi_major;      /* RSV_ABI_MAJOR */
  uint16_t abi_minor;      /* RSV_ABI_MINOR */
  uint32_t size;           /* sizeof(rsv_declaration) */
  uint16_t min_host_minor; /* the lowest minor of the host that will do */
  uint16_t kind;           /* RSV_KIND_ */
  uint32_t flags;          /* zero */
  uint8_t reserved[8];     /* zero */
} rsv_header;

typedef rsv_status (*rsv_entry)(const rsv_host_info *host, rsv_table *table, rsv_error *error);

/* Export exactly one, under the name resurvey_plugin_v1__X, X any letters, digits and underscores of your own: two
 * plugins may be linked into one program. Build with -fvisibility=hidden, so that nothing else is exported; in C++ with
 * -fno-gnu-unique (GCC) and -Wl,--exclude-libs,ALL as well, or templates of the standard library are. C++ keeps a const to
 * its own file: declare it first, within extern "C":
 *   RSV_EXPORT extern const rsv_declaration resurvey_plugin_v1__X; */
typedef struct rsv_declaration {
  rsv_header header;
  rsv_entry entry;
  char name[48];     /* a-z, 0-9 and dashes; this and the two below end with a zero byte */
  char version[24];
  char summary[160]; /* one sentence */
} rsv_declaration;

#define RSV_HEADER(kind_)                                                                                              \
  {                                                                                                                    \
    {'R', 'E', 'S', 'U', 'R', 'V', 'E', 'Y'}, RSV_ABI_MAJOR, RSV_ABI_MINOR, sizeof(rsv_declaration),                   \
    (kind_) == RSV_KIND_SEGMENTER, (kind_), 0, { 0 }                                                                   \
  }

/* Whether the struct behind a pointer reaches as far as a field: that of an older host may end before it.
 *   if (RSV_HAS(rsv_services, services, cast_rays) && services->cast_rays) ... */
#define RSV_HAS(type_, pointer_, field_) ((pointer_)->size >= offsetof(type_, field_) + sizeof((pointer_)->field_))

/* 1 when the host wants the call to end: return RSV_CANCELLED within 200 ms. 0 also where the host cannot say. */
static inline uint32_t rsv_cancelled(const rsv_services *services) {
  return RSV_HAS(rsv_services, services, cancelled) && services->cancelled ? services->cancelled(services->context) : 0;
}

/* Writes text to error, cut to fit, and gives RSV_FAILED: return rsv_fail(error, "no sky in the photo"); */
static inline rsv_status rsv_fail(rsv_error *error, const char *text) {
  if (error && error->data) {
    size_t length = strlen(text);
    if (length > error->capacity) {
      length = error->capacity;
      /* Not in the middle of a character. */
      while (length && ((unsigned char)text[length] & 0xc0) == 0x80) length--;
    }
    memcpy(error->data, text, length);
    error->length = (uint32_t)length;
  }
  return RSV_FAILED;
}

/* The first value of a row. Rows may be padded: data + row * width is wrong.
 *   const uint8_t *classes = (const uint8_t *)rsv_row(photo, v); */
static inline const void *rsv_row(const rsv_image *image, uint32_t row) {
  return (const char *)image->data + row * image->row_bytes;
}

/* The class that the map calls so, such as "banner"; null when it has none. */
static inline const rsv_class *rsv_class_named(const rsv_services *services, const char *name) {
  size_t length = strlen(name);
  for (size_t i = 0; i < services->class_count; i++) {
    const rsv_class *one = &services->classes[i];
    if (one->name.length == length && !memcmp(one->name.data, name, length)) return one;
  }
  return NULL;
}

/* ---- settings in create, without a JSON library --------------------------------------------------------------------- */

/* What stands behind "name": as it is written; data is null when the schema does not have it. */
static inline rsv_text rsv_setting(rsv_text settings, const char *name) {
  size_t length = strlen(name);
  rsv_text value = {NULL, 0};
  /* A quote within a text has a backslash before it, so that this is found where the name of a setting stands alone. */
  for (size_t i = 0; i + length + 3 < settings.length; i++) {
    const char *at = settings.data + i;
    if (at[0] != '"' || memcmp(at + 1, name, length) || at[length + 1] != '"' || at[length + 2] != ':') continue;
    value.data = at + length + 3;
    int is_text = *value.data == '"';
    size_t left = settings.length - i - length - 3, end = is_text ? 1 : 0;
    while (end < left && (is_text ? value.data[end] != '"' : value.data[end] != ',' && value.data[end] != '}'))
      end += value.data[end] == '\\' ? 2 : 1;
    value.length = end + (is_text ? 1 : 0) < left ? end + (is_text ? 1 : 0) : left;
    return value;
  }
  return value;
}

/* The number of a setting; 0 where it is none. */
static inline double rsv_setting_number(rsv_text settings, const char *name) {
  rsv_text value = rsv_setting(settings, name);
  char digits[40] = {0}; /* the text has no zero at its end, which strtod needs */
  if (value.data) memcpy(digits, value.data, value.length < sizeof digits ? value.length : sizeof digits - 1);
  return strtod(digits, NULL);
}

/* 1 when a setting is true. */
static inline int rsv_setting_is_true(rsv_text settings, const char *name) {
  rsv_text value = rsv_setting(settings, name);
  return value.length == 4 && !memcmp(value.data, "true", 4);
}

/* Writes the text of a setting with a zero at its end, such as the path of a file, and gives its length; when that is
 * capacity or more, it was cut. */
static inline size_t rsv_setting_text(rsv_text settings, const char *name, char *to, size_t capacity) {
  static const char escaped[] = "bfnrt", meant[] = "\b\f\n\r\t";
  rsv_text value = rsv_setting(settings, name);
  size_t length = 0;
  for (size_t i = 1; i + 1 < value.length; i++) {
    char one = value.data[i];
    if (one == '\\' && i + 2 < value.length) {
      one = value.data[++i];
      const char *escape = strchr(escaped, one);
      if (escape) one = meant[escape - escaped];
      if (one == 'u' && i + 5 < value.length) { /* the host escapes nothing but control characters so */
        char digits[5] = {0};
        memcpy(digits, value.data + i + 1, 4);
        one = (char)strtoul(digits, NULL, 16);
        i += 4;
      }
    }
    if (length + 1 < capacity) to[length] = one;
    length++;
  }
  if (capacity) to[length < capacity ? length : capacity - 1] = 0;
  return length;
}

#ifdef __cplusplus
}
#endif
#endif
