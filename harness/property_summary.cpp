#include "harness/property_summary.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "model/io/json_number.h"

namespace cutproof::harness {

namespace {

// NaN is greater than any number.
void raise(double& greatest, double value) {
  if (std::isnan(value) || value > greatest) greatest = value;
}
void raise(std::optional<double>& greatest, std::optional<double> value) {
  if (!value) return;
  if (!greatest) greatest = value;
  raise(*greatest, *value);
}

}  // namespace

nlohmann::json to_json(const PropertySummary& summary) {
  return {{"property", summary.property},
          {"stage", name_of(summary.stage)},
          {"unit", summary.unit},
          {"judged", summary.judged},
          {"checked", summary.checked},
          {"failed", summary.failed},
          {"inconclusive", summary.inconclusive},
          {"seconds", summary.seconds},
          {"measured", json_number(summary.measured)},
          {"of_bound", json_number(summary.of_bound)}};
}

void add_summary(nlohmann::json& sum, const nlohmann::json& more) {
  for (const char* count : {"judged", "checked", "failed", "inconclusive"}) {
    sum[count] = sum.at(count).get<int64_t>() + more.at(count).get<int64_t>();
  }
  sum["seconds"] = sum.at("seconds").get<double>() + more.at("seconds").get<double>();
  for (const char* greatest : {"measured", "of_bound"}) {
    // A number, nothing, or of what failed a word such as "inf".
    const nlohmann::json &here = sum.at(greatest), &there = more.at(greatest);
    const bool greater = there.is_string() || here.is_null() ||
                         (here.is_number() && there.is_number() && there.get<double>() > here.get<double>());
    if (greater && !here.is_string()) sum[greatest] = there;
  }
}

nlohmann::json PropertySummaries::to_json(bool in_stages) const {
  nlohmann::json list = nlohmann::json::array();
  for (const PropertySummary& summary : all_) {
    list.push_back(harness::to_json(summary));
    if (!in_stages) list.back()["stage"] = nullptr;
  }
  return list;
}

const PropertySummary* PropertySummaries::find(const std::string& property, Stage stage) const {
  const auto found = std::find_if(all_.begin(), all_.end(), [&](const PropertySummary& one) {
    return one.property == property && one.stage == stage;
  });
  return found != all_.end() ? &*found : nullptr;
}

PropertySummary& PropertySummaries::entry(const std::string& property, Stage stage, const std::string& unit) {
  const PropertySummary* const known = find(property, stage);
  if (known != nullptr) return all_[static_cast<std::size_t>(known - all_.data())];
  PropertySummary summary;
  summary.property = property;
  summary.stage = stage;
  summary.unit = unit;
  return all_.emplace_back(std::move(summary));
}

void PropertySummaries::add(const Verdict& verdict) {
  add(verdict, verdict.checked > 0 || !verdict.holds ? 1 : 0, verdict.holds ? 0 : 1);
}

void PropertySummaries::add(const Verdict& verdict, int64_t judged, int64_t failed) {
  PropertySummary& summary = entry(verdict.property, verdict.stage, verdict.unit);
  summary.judged += judged;
  summary.checked += verdict.checked;
  summary.failed += failed;
  summary.inconclusive += verdict.inconclusive;
  summary.seconds += verdict.took.seconds;
  if (verdict.checked == 0) return;
  raise(summary.measured, verdict.measured);
  if (verdict.bound > 0 && std::isfinite(verdict.bound)) {
    raise(summary.of_bound, std::optional(verdict.measured / verdict.bound));
  }
}

void PropertySummaries::join(const PropertySummaries& other) {
  for (const PropertySummary& theirs : other.all_) {
    PropertySummary& ours = entry(theirs.property, theirs.stage, theirs.unit);
    ours.judged += theirs.judged;
    ours.checked += theirs.checked;
    ours.failed += theirs.failed;
    ours.inconclusive += theirs.inconclusive;
    ours.seconds += theirs.seconds;
    raise(ours.measured, theirs.measured);
    raise(ours.of_bound, theirs.of_bound);
  }
}

}  // namespace cutproof::harness
