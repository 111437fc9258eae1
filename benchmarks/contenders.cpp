#include "benchmarks/contenders.h"

#include <fmt/format.h>

#include "benchmarks/report.h"

namespace cutproof::benchmarks {

const char* name_of(Precision precision) { return precision == Precision::binary64 ? "double" : "single"; }

std::vector<Contender> make_contenders(const std::string& backend, const std::string& split,
                                       const std::string& rotation) {
  const harness::BackendDescriptor& described = require_timed_backend(backend);
  harness::BackendChoice choice;
  choice.name = backend;
  choice.rotation = rotation;
  std::vector<std::string> splits = {split};
  if (described.takes_kernel_options) {
    if (split.empty()) splits = {"blocks"};
    if (split == "both") splits = {"blocks", "global"};
    require_option(splits.size() == 2 || splits[0] == "blocks" || splits[0] == "global", "--split",
                   fmt::format("there is no split method '{}'", split), "use blocks, global or both");
  }
  std::vector<Contender> contenders;
  for (const std::string& name : splits) {
    choice.split = name;
    contenders.push_back(
        {&described, harness::rotation_of(choice), harness::split_of(choice), harness::make_backend(choice)});
  }
  return contenders;
}

}  // namespace cutproof::benchmarks
