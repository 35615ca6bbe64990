/* A matcher that searches by itself: it compares a panorama at every place of a grid with the photo, climbs from the best
 * headings, and says how sure it is. The host renders and counts; where to look, and what to make of the counts, is decided
 * here.
 *
 * Build: cc -std=c11 -O2 -g -Wall -Wextra -fPIC -shared -fvisibility=hidden plugin.c -o libmy_plugin.so -lm
 * Check: resurvey plugins check libmy_plugin.so
 *
 * resurvey_plugin.h is the whole contract, with its rules in front. */
#include "resurvey_plugin.h"
#include <math.h>
#include <stdlib.h>

#define TURN 6.283185307179586
#define COLUMNS 180          /* of a panorama: 2 degrees each */
#define HILLS 8              /* how many are climbed */
#define HALVINGS 5           /* of the steps of a climb */
#define DIRECTIONS 20        /* of a step of a climb */
#define SHARPNESS 75.0       /* the likelihood of a pose is exp(SHARPNESS * score) */

/* The host checks settings against this schema, fills in what the user did not say, and hands over all of them. */
static const char schema[] =
    "{\"type\": \"object\", \"additionalProperties\": false, \"properties\": {"
    "\"step_m\": {\"type\": \"number\", \"default\": 3, \"minimum\": 0.5, \"maximum\": 20,"
    " \"description\": \"distance between the places of the grid, metres\"},"
    "\"reach\": {\"type\": \"number\", \"default\": 2.5, \"minimum\": 0.5, \"maximum\": 4,"
    " \"description\": \"how far around the prior is searched, in its sigmas\"}}}";

struct rsv_instance {
  double step_m, reach;
};

static rsv_status create(rsv_text settings, rsv_instance **instance, rsv_error *error) {
  rsv_instance *made = malloc(sizeof *made);
  if (!made) return rsv_fail(error, "out of memory");
  made->step_m = rsv_setting_number(settings, "step_m");
  made->reach = rsv_setting_number(settings, "reach");
  *instance = made;
  return RSV_OK;
}

static void destroy(rsv_instance *instance) { free(instance); }

/* A pose as numbers that can be stepped along: easting, northing, height, yaw, pitch, roll; and how well it fits. */
typedef struct scored {
  double at[6], score;
} scored;

static rsv_pose pose_of(const double at[6]) { return (rsv_pose){{at[0], at[1], at[2]}, at[3], at[4], at[5]}; }

static double distance_m(const scored *a, const scored *b) { return hypot(a->at[0] - b->at[0], a->at[1] - b->at[1]); }

static double likelihood(double score, double best) { return exp(fmin(0, SHARPNESS * (score - best))); }

/* What a search works with. */
typedef struct work {
  const rsv_services *services;
  const rsv_photo *photo;
  rsv_error *error;
  uint64_t hidden[4];       /* classes of what moves: it hides the map and takes no part */
  rsv_class_counts *counts; /* of the last request */
  scored *tried;
  double (*heat)[3]; /* easting, northing and the best score of every place */
  size_t tried_count, places, skipped;
} work;

/* Share of the compared pixels whose class is the same, from the counts of one view; 0 where nothing was compared. */
static double share(const work *work, const rsv_class_counts *counts) {
  double same = 0, compared = 0;
  for (uint32_t i = 0; i < work->services->class_slots; i++) same += counts[i].both, compared += counts[i].photo;
  return compared > 0 ? same / compared : 0;
}

/* Fills the scores of up to DIRECTIONS poses. */
static rsv_status compare(work *work, scored *poses, size_t count) {
  /* Return within 200 ms of a cancel. */
  if (rsv_cancelled(work->services)) return RSV_CANCELLED;
  rsv_pose at[DIRECTIONS];
  for (size_t i = 0; i < count; i++) at[i] = pose_of(poses[i].at);
  uint32_t stride = work->photo->camera->width / 240;
  rsv_compare_request request = {.size = sizeof request, .stride = stride ? stride : 1};
  memcpy(request.ignored_in_photo, work->hidden, sizeof work->hidden);
  rsv_status status =
      work->services->compare_views(work->services->context, &request, at, count, work->counts, work->error);
  for (size_t i = 0; i < count && status == RSV_OK; i++)
    poses[i].score = share(work, work->counts + i * work->services->class_slots);
  return status;
}

/* Compares every heading at every place of the grid that is not inside a building. */
static rsv_status panoramas(const rsv_instance *instance, work *work) {
  const rsv_prior *prior = work->photo->prior;
  const rsv_services *services = work->services;
  double radius_m = instance->reach * prior->position_sigma_m, column = TURN / COLUMNS;
  int steps = (int)(radius_m / instance->step_m);
  int turns = (int)fmin(COLUMNS / 2, ceil(instance->reach * prior->yaw_sigma_rad / column));
  uint32_t yaws = 2 * (uint32_t)turns + 1;
  rsv_panorama_request request = {.size = sizeof request,
                                  .columns = COLUMNS,
                                  .yaw_step_columns = 1,
                                  .yaw_count = yaws,
                                  .first_yaw_rad = (round(prior->pose.yaw_rad / column) - turns) * column,
                                  .pitch_rad = prior->pose.pitch_rad,
                                  .roll_rad = prior->pose.roll_rad};
  memcpy(request.ignored_in_photo, work->hidden, sizeof work->hidden);
  size_t places = (size_t)(2 * steps + 1) * (size_t)(2 * steps + 1);
  work->counts = calloc((size_t)services->class_slots * (yaws > DIRECTIONS ? yaws : DIRECTIONS), sizeof *work->counts);
  work->tried = malloc(places * yaws * sizeof *work->tried);
  work->heat = malloc(places * sizeof *work->heat);
  if (!work->counts || !work->tried || !work->heat) return rsv_fail(work->error, "out of memory");
  for (int east = -steps; east <= steps; east++)
    for (int north = -steps; north <= steps; north++) {
      if (hypot(east, north) * instance->step_m > radius_m) continue;
      rsv_point place = prior->pose.position;
      place.easting_m += east * instance->step_m;
      place.northing_m += north * instance->step_m;
      if (rsv_cancelled(services)) return RSV_CANCELLED;
      uint8_t inside = 0;
      rsv_status status = services->inside_solid(services->context, &place, 1, &inside, work->error);
      if (status == RSV_OK && inside) work->skipped++;
      if (status == RSV_OK && inside) continue;
      if (status == RSV_OK)
        status = services->compare_panoramas(services->context, &request, &place, 1, work->counts, work->error);
      if (status != RSV_OK) return status;
      double *best = work->heat[work->places++];
      best[0] = place.easting_m, best[1] = place.northing_m, best[2] = 0;
      for (uint32_t i = 0; i < yaws; i++) {
        double score = share(work, work->counts + (size_t)i * services->class_slots);
        work->tried[work->tried_count++] =
            (scored){{place.easting_m, place.northing_m, place.height_m, request.first_yaw_rad + i * column,
                      request.pitch_rad, request.roll_rad},
                     score};
        best[2] = fmax(best[2], score);
      }
    }
  return work->tried_count ? RSV_OK : rsv_fail(work->error, "expected a place outside of buildings, found none");
}

static int by_score(const void *a, const void *b) {
  double x = ((const scored *)a)->score, y = ((const scored *)b)->score;
  return (x < y) - (x > y);
}

/* The best that are more than 3 m or 6 degrees from each other. */
static size_t apart(work *work, scored *hills) {
  size_t count = 0;
  qsort(work->tried, work->tried_count, sizeof *work->tried, by_score);
  for (size_t i = 0; i < work->tried_count && count < HILLS; i++) {
    int is_far = 1;
    for (size_t j = 0; j < count; j++)
      is_far &= distance_m(&work->tried[i], &hills[j]) > 3 || fabs(work->tried[i].at[3] - hills[j].at[3]) > 0.1;
    if (is_far) hills[count++] = work->tried[i];
  }
  return count;
}

/* The score less what it costs to leave the height, pitch and roll that the phone knows. */
static double worth(const work *work, const scored *one) {
  const rsv_prior *prior = work->photo->prior;
  double height = (one->at[2] - prior->pose.position.height_m) / fmax(prior->height_sigma_m, 1e-6);
  double pitch = (one->at[4] - prior->pose.pitch_rad) / fmax(prior->tilt_sigma_rad, 1e-6);
  double roll = (one->at[5] - prior->pose.roll_rad) / fmax(prior->tilt_sigma_rad, 1e-6);
  return one->score - (height * height + pitch * pitch + roll * roll) / (2 * SHARPNESS);
}

/* To the top of the hill: a compass search with ever shorter steps (Hooke & Jeeves 1961), along every axis, and sideways with
 * a turn. A metre aside and four degrees nearly keep what is 15 m ahead in its place. */
static rsv_status climb(work *work, scored *best) {
  double steps[6] = {1, 1, 0.3, 0.07, 0.0175, 0.0175};
  rsv_status status = compare(work, best, 1);
  for (int round = 0, halvings = 0; round < 60 && status == RSV_OK; round++) {
    scored tried[DIRECTIONS];
    for (int i = 0; i < DIRECTIONS; i++) {
      tried[i] = *best;
      int axis = i < 12 ? i / 2 : (i - 12) / 4;
      tried[i].at[axis] += i % 2 ? steps[axis] : -steps[axis];
      if (i >= 12) tried[i].at[3] += i / 2 % 2 ? steps[3] : -steps[3];
    }
    status = compare(work, tried, DIRECTIONS);
    const scored *top = tried;
    for (int i = 1; i < DIRECTIONS; i++)
      if (worth(work, &tried[i]) > worth(work, top)) top = &tried[i];
    if (worth(work, top) > worth(work, best)) {
      *best = *top;
    } else {
      if (halvings++ == HALVINGS) break;
      for (int i = 0; i < 6; i++) steps[i] /= 2;
    }
  }
  return status;
}

/* Second moments of the likelihood over 2 m and 2 degrees around the best; at least 0.1 m and 0.1 degrees. */
static rsv_status doubt(work *work, const scored *best, double covariance[9]) {
  double total = 0, sum[3] = {0, 0, 0}, squares[9] = {0};
  const double floor[3] = {0.1, 0.1, 0.00175};
  for (int turn = -2; turn <= 2; turn++)
    for (int east = -3; east <= 3; east++) {
      scored tried[7];
      for (int north = -3; north <= 3; north++) {
        scored *one = &tried[north + 3];
        *one = *best;
        one->at[0] += east * 2.0 / 3, one->at[1] += north * 2.0 / 3, one->at[3] += turn * 0.0175;
      }
      rsv_status status = compare(work, tried, 7);
      if (status != RSV_OK) return status;
      for (int k = 0; k < 7; k++) {
        const double off[3] = {tried[k].at[0] - best->at[0], tried[k].at[1] - best->at[1], tried[k].at[3] - best->at[3]};
        double weight = likelihood(tried[k].score, best->score);
        total += weight;
        for (int i = 0; i < 3; i++) sum[i] += weight * off[i];
        for (int i = 0; i < 9; i++) squares[i] += weight * off[i / 3] * off[i % 3];
      }
    }
  for (int i = 0; i < 9; i++)
    covariance[i] = squares[i] / total - sum[i / 3] * sum[i % 3] / (total * total) +
                    (i / 3 == i % 3 ? floor[i / 3] * floor[i / 3] : 0);
  return RSV_OK;
}

static rsv_status find(const rsv_instance *instance, work *work, const rsv_results *results, rsv_localization *found) {
  scored hills[HILLS];
  rsv_status status = panoramas(instance, work);
  size_t count = status == RSV_OK ? apart(work, hills) : 0;
  for (size_t i = 0; i < count && status == RSV_OK; i++) status = climb(work, &hills[i]);
  if (status != RSV_OK) return status;
  qsort(hills, count, sizeof *hills, by_score);
  found->pose = pose_of(hills[0].at);
  found->score = hills[0].score;
  found->candidates = work->tried_count;
  found->skipped = work->skipped;
  for (size_t i = count; i-- > 1;) { /* the best of those elsewhere stays */
    if (distance_m(&hills[i], &hills[0]) <= 2.5) continue;
    found->has_runner_up = 1;
    found->runner_up_distance_m = distance_m(&hills[i], &hills[0]);
    found->runner_up_score_ratio = likelihood(hills[i].score, hills[0].score);
  }
  if (results->heat(results->context, (const double(*)[3])work->heat, work->places) != RSV_OK)
    return rsv_fail(work->error, "the host did not take the heat map");
  return doubt(work, &hills[0], found->covariance);
}

static rsv_status search(rsv_instance *instance, const rsv_services *services, const rsv_photo *photo,
                         const rsv_results *results, rsv_localization *found, rsv_error *error) {
  work work = {.services = services, .photo = photo, .error = error};
  size_t labelled = 0;
  for (uint32_t v = 0; v < photo->labels.height; v++)
    for (uint32_t u = 0; u < photo->labels.width; u++)
      labelled += ((const uint8_t *)rsv_row(&photo->labels, v))[u] != RSV_VOID;
  if (!labelled) return rsv_fail(error, "expected labels in the photo, found only void");
  for (size_t i = 0; i < services->class_count; i++) {
    uint8_t index = services->classes[i].index;
    if (services->classes[i].kind == RSV_CLASS_DYNAMIC) work.hidden[index / 64] |= (uint64_t)1 << index % 64;
  }
  rsv_status status = find(instance, &work, results, found);
  free(work.counts);
  free(work.tried);
  free(work.heat);
  return status;
}

/* The host calls this once, after it has opened the library. `size` of the table is the host's: leave it alone. */
static rsv_status entry(const rsv_host_info *host, rsv_table *table, rsv_error *error) {
  (void)host;
  (void)error;
  table->settings_schema.data = schema;
  table->settings_schema.length = sizeof schema - 1;
  table->create = create;
  table->destroy = destroy;
  table->search = search;
  return RSV_OK;
}

/* The one symbol of the library: kind, entry, name, version, and a sentence for `resurvey plugins list`. */
RSV_EXPORT const rsv_declaration resurvey_plugin_v1__my_plugin = {
    RSV_HEADER(RSV_KIND_MATCHER), entry, "my-plugin", "0.1.0",
    "Compares panoramas over a grid, then climbs from the best headings"};
