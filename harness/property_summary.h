// Summary of the verdicts of a property over a run or a campaign.
#pragma once
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "model/verdict.h"

namespace cutproof::harness {

// Summary of one property after one stage.
struct PropertySummary {
  std::string property;
  Stage stage = Stage::skin;
  std::string unit;
  int64_t judged = 0;        // verdicts that looked at something, or fail
  int64_t checked = 0;       // things that they looked at
  int64_t failed = 0;        // expected or not
  int64_t inconclusive = 0;  // of what was checked (Verdict::inconclusive)
  double seconds = 0;        // of judging, by all threads (Verdict::took)
  double measured = 0;       // greatest
  // Greatest measured / bound. Empty if every bound is 0, as for counts.
  std::optional<double> of_bound;
};

// The entry of a result document; entries of other documents can be added.
nlohmann::json to_json(const PropertySummary& summary);
void add_summary(nlohmann::json& sum, const nlohmann::json& more);

class PropertySummaries {
 public:
  void add(const Verdict& verdict);
  // The same where things are counted that one verdict is about several of: so many were judged, so many are wrong.
  void add(const Verdict& verdict, int64_t judged, int64_t failed);
  void join(const PropertySummaries& other);

  // In the order in which they were first added.
  const std::vector<PropertySummary>& all() const { return all_; }
  // A list of them. `in_stages`: else they are of what has no stages, and name none.
  nlohmann::json to_json(bool in_stages = true) const;
  // Null if no verdict of this property after this stage was added.
  const PropertySummary* find(const std::string& property, Stage stage) const;

 private:
  PropertySummary& entry(const std::string& property, Stage stage, const std::string& unit);
  std::vector<PropertySummary> all_;
};

}  // namespace cutproof::harness
