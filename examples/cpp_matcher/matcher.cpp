// A matcher in C++17: agreement of the classes beyond what chance gives (Cohen's kappa). Photos that are one half sky agree
// with every view that is one half sky; kappa does not count that.
//
// -fno-gnu-unique (GCC's alone) and --exclude-libs keep what the standard library instantiates in here apart from that of others.
//
// Build: c++ -std=c++17 -O2 -g -Wall -Wextra -fPIC -shared -fvisibility=hidden -fno-gnu-unique -Wl,--exclude-libs,ALL -I schema/include examples/cpp_matcher/matcher.cpp -o libkappa.so
// Check: resurvey plugins check libkappa.so

#include "resurvey_plugin.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string_view>

namespace {

// The host checks settings against this schema, fills in what the user did not say, and hands over all of them.
constexpr std::string_view schema = R"({"type": "object", "additionalProperties": false, "properties": {
  "compare_sky": {"type": "boolean", "default": true, "description": "Whether pixels that are sky in both count."},
  "sky_class": {"type": "integer", "default": 6, "minimum": 0, "maximum": 254, "description": "Index of sky."}}})";

// An image of the C line as C++ would have it: rows that can be iterated over, whatever their padding.
template <typename Value>
class Image {
 public:
  explicit Image(const rsv_image& image) : image_(image) {}
  std::uint32_t height() const { return image_.height; }
  const Value* begin(std::uint32_t row) const {
    return static_cast<const Value*>(rsv_row(&image_, row));
  }
  const Value* end(std::uint32_t row) const { return begin(row) + image_.width; }

 private:
  rsv_image image_;
};

// A failure that is no bug: the text says what was expected and what was found.
struct Failed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// No exception may leave a function of the plugin: each becomes a status with its text.
template <typename Body>
rsv_status guarded(rsv_error* error, Body body) noexcept {
  try {
    body();
    return RSV_OK;
  } catch (const Failed& failed) {
    return rsv_fail(error, failed.what());
  } catch (const std::exception& bug) {
    rsv_fail(error, bug.what());
  } catch (...) {
    rsv_fail(error, "an exception of unknown type");
  }
  return RSV_PANICKED;
}

}  // namespace

// What the header calls an instance is ours to define.
struct rsv_instance {
  bool compare_sky;
  std::uint8_t sky;

  // The header reads settings, so that a few numbers need no JSON library.
  explicit rsv_instance(rsv_text settings)
      : compare_sky(rsv_setting_is_true(settings, "compare_sky") != 0),
        sky(static_cast<std::uint8_t>(rsv_setting_number(settings, "sky_class"))) {}

  double score(const Image<std::uint8_t>& photo, const Image<std::uint8_t>& view) const {
    std::array<std::uint64_t, 256> in_photo{}, in_view{};
    std::uint64_t same = 0, compared = 0;
    for (std::uint32_t row = 0; row < photo.height(); row++) {
      const std::uint8_t* b = view.begin(row);
      for (const std::uint8_t* a = photo.begin(row); a != photo.end(row); ++a, ++b) {
        if (*a == RSV_VOID || (!compare_sky && *a == sky && *b == sky)) continue;
        compared++, in_photo[*a]++, in_view[*b]++;
        same += *a == *b;
      }
    }
    if (compared == 0) throw Failed("expected pixels to compare, found only void and sky");
    const double total = static_cast<double>(compared), agreed = static_cast<double>(same) / total;
    double chance = 0;
    for (std::size_t i = 0; i < in_photo.size(); i++)
      chance += static_cast<double>(in_photo[i]) / total * (static_cast<double>(in_view[i]) / total);
    // Where both show one and the same class there is nothing beyond chance.
    return chance < 1 ? std::clamp((agreed - chance) / (1 - chance), 0.0, 1.0) : 1.0;
  }
};

extern "C" {

static rsv_status create(rsv_text settings, rsv_instance** instance, rsv_error* error) {
  return guarded(error, [&] { *instance = std::make_unique<rsv_instance>(settings).release(); });
}

static void destroy(rsv_instance* instance) { delete instance; }

static rsv_status score(rsv_instance* instance, const rsv_image* photo, const rsv_view* view, double* score,
                        rsv_error* error) {
  return guarded(error, [&] { *score = instance->score(Image<std::uint8_t>(*photo), Image<std::uint8_t>(view->labels)); });
}

static rsv_status entry(const rsv_host_info*, rsv_table* table, rsv_error*) {
  table->settings_schema = {schema.data(), schema.size()};
  table->create = create;
  table->destroy = destroy;
  table->score = score;
  return RSV_OK;
}

// A const of C++ is seen in its own file alone; declared extern "C" first, it is exported under its plain name.
RSV_EXPORT extern const rsv_declaration resurvey_plugin_v1__kappa;
const rsv_declaration resurvey_plugin_v1__kappa = {RSV_HEADER(RSV_KIND_MATCHER), entry, "kappa", "1.0.0",
                                                   "Agreement of the classes beyond chance: Cohen's kappa"};
}
