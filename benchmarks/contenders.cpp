#include "benchmarks/contenders.h"

#include <fmt/format.h>

#include "benchmarks/provenance.h"
#include "model/error.h"

namespace cutproof::benchmarks {

namespace {

std::vector<std::string> split_names(const std::string& wanted) {
  if (wanted == "blocks" || wanted == "global") return {wanted};
  if (wanted == "both") return {"blocks", "global"};
  throw InputError("command line", "--split", fmt::format("there is no split method '{}'", wanted),
                   "use blocks, global or both");
}

Contender make_contender(const harness::BackendDescriptor& backend, const harness::BackendChoice& choice) {
  std::unique_ptr<Backend> instance = harness::make_backend(choice);
  return {choice.name,       name_of(backend.precision),   harness::rotation_of(choice), harness::split_of(choice),
          backend.pipelines, backend.takes_kernel_options, std::move(instance)};
}

}  // namespace

const char* name_of(Precision precision) { return precision == Precision::binary64 ? "double" : "single"; }

std::vector<Contender> make_contenders(const std::string& backend, const std::string& split,
                                       const std::string& rotation) {
  const harness::BackendDescriptor& described = require_timed_backend(backend);
  harness::BackendChoice choice;
  choice.name = backend;
  choice.rotation = rotation;
  choice.split = split;
  std::vector<Contender> contenders;
  if (described.takes_kernel_options) {
    for (const std::string& name : split_names(split.empty() ? "blocks" : split)) {
      choice.split = name;
      contenders.push_back(make_contender(described, choice));
    }
  } else {
    contenders.push_back(make_contender(described, choice));
  }
  return contenders;
}

}  // namespace cutproof::benchmarks
