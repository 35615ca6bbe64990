// A matcher: how well does one view of the map fit the photo? The host makes the candidate poses, renders and searches.
//
// Build: make
// Check: resurvey plugins check libmy_plugin.so
//
// resurvey_plugin.h is the whole contract, with its rules in front.
#include "resurvey_plugin.h"

#include <exception>
#include <stdexcept>
#include <string_view>

namespace {

// The host checks settings against this schema, fills in what the user did not say, and hands over all of them.
constexpr std::string_view schema = R"({"type": "object", "additionalProperties": false, "properties": {
  "void": {"type": "integer", "default": 255, "minimum": 0, "maximum": 255,
           "description": "class of the photo that is not compared"}}})";

// There is no answer: the text says what was expected and what was found, and is shown to the user.
struct Failed : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// Share of the pixels whose class is the same in photo and view: put your matcher in its place.
class MyMatcher {
 public:
  explicit MyMatcher(rsv_text settings) : void_class_(static_cast<uint8_t>(rsv_setting_number(settings, "void"))) {}

  // From 0 to 1, higher is better; photo and view have one size.
  double score(const rsv_image& photo, const rsv_view& view) const {
    std::size_t same = 0, compared = 0;
    for (uint32_t v = 0; v < photo.height; v++) {
      // Rows may be padded: never data + v * width.
      const auto* in_photo = static_cast<const uint8_t*>(rsv_row(&photo, v));
      const auto* in_view = static_cast<const uint8_t*>(rsv_row(&view.labels, v));
      for (uint32_t u = 0; u < photo.width; u++) {
        if (in_photo[u] == void_class_) continue;
        compared++;
        same += in_photo[u] == in_view[u];
      }
    }
    if (compared == 0) throw Failed("expected labels in the photo, found only void");
    return static_cast<double>(same) / static_cast<double>(compared);
  }

 private:
  uint8_t void_class_;
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
  MyMatcher matcher;
};

namespace {

rsv_status create(rsv_text settings, rsv_instance** instance, rsv_error* error) {
  return guarded(error, [&] { *instance = new rsv_instance{MyMatcher(settings)}; });
}

void destroy(rsv_instance* instance) { delete instance; }

rsv_status score(rsv_instance* instance, const rsv_image* photo, const rsv_view* view, double* score, rsv_error* error) {
  return guarded(error, [&] { *score = instance->matcher.score(*photo, *view); });
}

// The host calls this once, after it has opened the library. `size` of the table is the host's: leave it alone.
rsv_status entry(const rsv_host_info*, rsv_table* table, rsv_error*) {
  table->settings_schema = {schema.data(), schema.size()};
  table->create = create;
  table->destroy = destroy;
  table->score = score;
  return RSV_OK;
}

}  // namespace

// The one symbol of the library: kind, entry, name, version, and a sentence for `resurvey plugins list`. A const of C++ is seen
// in its own file alone; declared extern "C" first, it is exported under its plain name.
extern "C" {
RSV_EXPORT extern const rsv_declaration resurvey_plugin_v1__my_plugin;
const rsv_declaration resurvey_plugin_v1__my_plugin = {RSV_HEADER(RSV_KIND_MATCHER), entry, "my-plugin", "0.1.0",
                                                       "Share of the pixels whose class is the same in photo and view"};
}
