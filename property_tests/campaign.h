// Random dissections at scale: many bodies in a batch, every stage judged by every oracle and compared with the
// reference. `cutproof fuzz` runs these campaigns.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "harness/backends.h"
#include "model/stop.h"
#include "property_tests/dissection.h"
#include "property_tests/histories.h"

namespace cutproof::property_tests {

struct CampaignOptions {
  uint64_t seed = 1;
  int64_t cases = 1000;                // of the whole campaign, all shards together
  std::optional<double> seconds;       // begins no further batch and judges no further case after this time
  int least_size = 0, most_size = 79;  // sizes of cases (cases.h) take turns
  bool dynamics = false;               // bodies move as well, and blades cut what they pass
  int batch = 64;                      // bodies in a batch
  int threads = 1;                     // generate cases, run batches and judge case by case
  int backends = 1;                    // greatest number of concurrent batches
  int devices = 1;                     // on which they run in turn; at most `backends`
  int thorough = 50;                   // every n-th case with CGAL's geometric check
  int64_t shard = 0, shards = 1;       // of cases 0, 1, 2, …: those that are `shard` modulo `shards`
  bool keep_going = false;             // beyond the first violation
  StopAsked stop_asked;                // begins no further case; those that were judged count
};

// Makes the backend of a batch, on one of `devices` (0 ..). If `fresh` is false, it is called once for each of
// `backends` only.
struct BackendSource {
  std::function<std::unique_ptr<Backend>(int64_t load, int device)> make;
  bool fresh = false;  // a new one for every batch, e.g. because schedules depend on it
};

// Backends by name, on these devices.
BackendSource source_of(const harness::BackendChoice& choice, const std::vector<int>& devices);
// Number of concurrent batches: as many as this number of the backend's devices takes, and at most one for each thread.
void set_parallel_loads(CampaignOptions& options, const harness::BackendDescriptor& backend, int devices);

struct Violation {
  int64_t index = 0;  // of the case
  Case failing;
  Verdict verdict;
};

struct Campaign {
  int64_t cases = 0, verdicts = 0, particles = 0;
  int64_t refused = 0;   // cases that the backend refused: nothing is known of them
  bool stopped = false;  // it was asked to stop, and did before its end
  CaseCoverage coverage;
  StepsCompared compared;
  harness::PropertySummaries properties;
  harness::StagesRun stages;
  std::vector<Violation> violations;  // by index; without keep_going the first alone
  double seconds = 0;                 // wall time
  // Times of all threads together [s]; `reference`: stages of the reference, for comparison.
  double generating = 0, running = 0, reference = 0, judging = 0;
};

// Default number of bodies in a batch. A small campaign has at least as many batches as a device runs at once.
int usual_batch(const CampaignOptions& options, const harness::BackendDescriptor& backend);

// The size of case `index`.
int size_at(const CampaignOptions& options, int64_t index);
// Case `index` of a campaign: the same on every platform, whatever the batch, the shards and the backend.
Case case_at(const CampaignOptions& options, int64_t index);

// `progress` is called from any thread, one at a time, whenever some cases have been judged. Throws what the machine
// throws (MachineError, std::bad_alloc); whatever else a backend throws is a violation of the case that makes it throw.
Campaign run_campaign(const CampaignOptions& options, const BackendSource& source,
                      const std::function<void(const Campaign&)>& progress);

// One case alone; a backend that throws gives a failing verdict.
Judgement dissect_alone(const std::function<std::unique_ptr<Backend>()>& make, const Case& c, bool thorough);
// The same of a history. It needs more than one backend, so `make` is called several times.
Judgement history_alone(const std::function<std::unique_ptr<Backend>()>& make, const Case& c,
                        const std::vector<Command>& commands);

}  // namespace cutproof::property_tests
