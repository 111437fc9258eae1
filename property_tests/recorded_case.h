// A case as a recording, for `cutproof check` and ParaView.
#pragma once
#include <memory>
#include <string>

#include "model/backend.h"
#include "property_tests/cases.h"

namespace cutproof::property_tests {

// Runs a case alone and records it under `name` (io::Recorder). Returns why it is not recorded, where a state is too
// broken to be written down; empty: it is. Throws InputError if it cannot be written there, MachineError.
std::string record_case(const std::string& name, const std::unique_ptr<Backend>& backend, const Case& c);

}  // namespace cutproof::property_tests
