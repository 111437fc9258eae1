#include "property_tests/recorded_case.h"

#include <vector>

#include "model/error.h"
#include "model/io/recording.h"
#include "property_tests/dissection.h"

namespace cutproof::property_tests {

namespace {

// Frames as a recording holds them (io::Recorder).
void record(const std::string& name, const Loaded& loaded, const Trail& trail, const std::string& backend) {
  io::Recorder recorder(name, loaded.setup, "", backend);
  recorder.add(Stage::skin, trail.initial);
  const State* before = &trail.initial;
  bool cut = false;
  for (const auto& [stage, after] : trail.steps) {
    if (stage == Stage::step) cut = false;
    if (stage == Stage::detect) cut = !after.removed.empty();
    const bool changed = stage == Stage::detect || !(after == *before);
    if (stage == Stage::skin || (cut && stage != Stage::step && changed)) recorder.add(stage, after);
    before = &after;
  }
  recorder.finish();
}

}  // namespace

std::string record_case(const std::string& name, const std::unique_ptr<Backend>& backend, const Case& c) {
  try {
    std::vector<Loaded> loaded = {load(c)};
    const std::vector<Trail> trails = run_cases(*backend, loaded);
    record(name, loaded.front(), trails.front(), backend->name());
    return {};
  } catch (const MachineError&) {
    throw;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  }
}

}  // namespace cutproof::property_tests
