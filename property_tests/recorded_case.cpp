#include "property_tests/recorded_case.h"

#include <vector>

#include "harness/frame_runner.h"
#include "model/error.h"
#include "model/io/recording.h"
#include "property_tests/dissection.h"

namespace cutproof::property_tests {

namespace {

// Frames as a recording holds them (io::Recorder).
void record(const std::string& name, const Instance& loaded, const harness::Trace& trace, const Backend& backend) {
  io::Recorder recorder(name, loaded.setup, "", backend.name(), harness::left_to_reference(backend));
  recorder.add(Stage::skin, *trace.initial);
  for (const harness::Moment& moment : trace.moments) recorder.add(moment.span.last, *moment.after);
  recorder.finish();
}

}  // namespace

std::string record_case(const std::string& name, const std::unique_ptr<Backend>& backend, const Case& c) {
  try {
    std::vector<Instance> loaded = {instance_of(c)};
    const std::vector<CaseRun> runs = run_cases(*backend, loaded);
    record(name, loaded.front(), runs.front().trace, *backend);
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
