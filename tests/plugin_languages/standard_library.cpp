// A matcher that uses what C++ programs use: shared pointers, containers, regular expressions.
#include "resurvey_plugin.h"

#include <memory>
#include <regex>
#include <string>
#include <unordered_map>
#include <vector>

struct rsv_instance {
  std::shared_ptr<std::unordered_map<int, bool>> ignored = std::make_shared<std::unordered_map<int, bool>>();
};

namespace {

constexpr char schema[] =
    "{\"type\": \"object\", \"additionalProperties\": false, \"properties\": {"
    "\"ignored\": {\"type\": \"string\", \"default\": \"255 7\", \"description\": \"Classes that are not compared.\"}}}";

rsv_status create(rsv_text settings, rsv_instance** instance, rsv_error* error) {
  std::vector<char> text(rsv_setting_text(settings, "ignored", nullptr, 0) + 1);
  rsv_setting_text(settings, "ignored", text.data(), text.size());
  try {
    auto made = std::make_unique<rsv_instance>();
    const std::string words(text.data());
    const std::regex number("[0-9]+");
    for (std::sregex_iterator found(words.begin(), words.end(), number), end; found != end; ++found)
      (*made->ignored)[std::stoi(found->str())] = true;
    *instance = made.release();
    return RSV_OK;
  } catch (const std::exception& failure) {
    return rsv_fail(error, failure.what());
  }
}

void destroy(rsv_instance* instance) { delete instance; }

rsv_status score(rsv_instance* instance, const rsv_image* photo, const rsv_view* view, double* score, rsv_error* error) {
  double same = 0, compared = 0;
  for (uint32_t v = 0; v < photo->height; v++) {
    const auto* a = static_cast<const uint8_t*>(rsv_row(photo, v));
    const auto* b = static_cast<const uint8_t*>(rsv_row(&view->labels, v));
    for (uint32_t u = 0; u < photo->width; u++) {
      if (instance->ignored->count(a[u])) continue;
      compared++;
      same += a[u] == b[u];
    }
  }
  if (compared == 0) return rsv_fail(error, "expected pixels to compare, found none");
  *score = same / compared;
  return RSV_OK;
}

rsv_status entry(const rsv_host_info*, rsv_table* table, rsv_error*) {
  table->settings_schema = {schema, sizeof schema - 1};
  table->create = create;
  table->destroy = destroy;
  table->score = score;
  return RSV_OK;
}

}  // namespace

extern "C" {
RSV_EXPORT extern const rsv_declaration resurvey_plugin_v1__standard_library;
const rsv_declaration resurvey_plugin_v1__standard_library = {RSV_HEADER(RSV_KIND_MATCHER), entry, "standard-library", "1.0.0",
                                                              "Share of equal pixels"};
}
