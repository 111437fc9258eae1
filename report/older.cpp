#include "report/older.h"

#include <fmt/format.h>

#include <map>
#include <string>

#include "report/document_fields.h"

namespace cutproof::report {

namespace {

using nlohmann::json;

int64_t today_of(const Field& document) {
  const std::string format = document["format"].text();
  return format == "cutproof.fuzz" ? kFuzzVersion : format == "cutproof.judge" ? kJudgeVersion : kBenchVersion;
}

// Of an object; whatever else it may be, its reader says.
void rename(json& in, const char* was, const char* is) {
  if (!in.is_object() || !in.contains(was) || in.contains(is)) return;
  in[is] = in[was];
  in.erase(was);
}

// Each entry of a list within an object.
template <class Use>
void each(json& in, const char* list, Use&& use) {
  if (!in.is_object() || !in.contains(list) || !in[list].is_array()) return;
  for (json& one : in[list]) {
    if (one.is_object()) use(one);
  }
}

void rename_campaign(Renamed& to, int64_t version) {
  json& document = to.document;
  rename(document, "version", "cutproof");
  if (version == 1) {
    rename(document, "happened", "coverage");
    if (document.contains("steps_compared")) rename(document["steps_compared"], "either", "undecidable");
  }
  const auto lacks = [&](const char* field, const char* words) {
    if (!document.contains(field)) to.notes.emplace_back(words);
  };
  lacks("properties",
        "It counts verdicts of all properties together: of which there were any, and how near each came to its bound, "
        "is not known.");
  lacks("refused", "Whether the backend refused any case is not known.");
}

// What a row of `stages` and the scene that it is of have in common, as one text.
std::string of_scene(const json& one) {
  json key = json::array();
  for (const char* const name : kOfAScene) key.push_back(one.value(name, json()));
  return key.dump(-1, ' ', false, json::error_handler_t::replace);
}

// Version 2 and before had a limit of the step alone, with the scene.
void move_limits(Renamed& to) {
  json& document = to.document;
  std::multimap<std::string, json*> steps;
  each(document, "rows", [&](json& row) {
    if (row.value("what", json()) == "step" && !row.contains("limit")) steps.emplace(of_scene(row), &row);
  });
  bool is_any = false;
  each(document, "scenes", [&](json& scene) {
    rename(scene, "step_floor", "step_limit");
    if (!scene.contains("step_limit") || !scene["step_limit"].is_object()) return;
    const auto [first, last] = steps.equal_range(of_scene(scene));
    for (auto step = first; step != last; ++step) {
      (*step->second)["limit"] = scene["step_limit"];
      is_any = true;
    }
    steps.erase(first, last);
  });
  to.notes.emplace_back(
      is_any ? "Of the stages the step alone has a limit: what its bytes or its launches take at best. Today's limits "
               "count kernels that wait for one another, so they are not to be compared with this one."
             : "It has no limits of stages.");
}

void rename_measurement(Renamed& to, int64_t version) {
  json& document = to.document;
  if (version == 1) {
    rename(document, "floors", "machine_limits");
    each(document, "methods", [](json& method) {
      rename(method, "floor_seconds_per_million", "limit_seconds_per_million");
      rename(method, "multiple_of_floor", "multiple_of_limit");
    });
    rename(document, "answer", "reference");
    each(document, "trials", [](json& trial) {
      if (trial.value("outcome", json()) == "dearer") trial["outcome"] = "more_expensive";
    });
    const auto is_of_stages = [&] {
      bool is_all = document.contains("rows") && document.contains("scenes");
      each(document, "rows", [&](json& row) { is_all = is_all && row.contains("what"); });
      return is_all;
    };
    if (!document.contains("suite") && is_of_stages()) {
      document["suite"] = "stages";
      to.notes.emplace_back("It does not say of which suite it is: times of single stages only 'stages' has.");
    }
  }
  if (document.value("suite", json()) == "stages") move_limits(to);
}

}  // namespace

bool is_older(const Field& document) { return document["format_version"].count() < today_of(document); }

std::optional<Renamed> renamed(const Field& document) {
  const Field field = document["format_version"];
  const int64_t version = field.count(), today = today_of(document);
  if (version < 1) field.refuse(fmt::format("there never was a version {}", version));
  if (version > today) {
    throw InputError(document.file, field.path,
                     fmt::format("this is version {}, and this program knows none after {}", version, today),
                     "make the page with the version of cutproof that has written it, or a later one");
  }
  if (version == today) return std::nullopt;
  Renamed to;
  to.document = *document.value;
  to.notes.push_back(fmt::format(
      "An older version of cutproof has written this (format version {}; today's is {}). The page shows what it says "
      "and fills in nothing.",
      version, today));
  if (document["format"].text() == "cutproof.fuzz") {
    rename_campaign(to, version);
  } else {
    rename_measurement(to, version);
  }
  return to;
}

}  // namespace cutproof::report
