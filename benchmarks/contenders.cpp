#include "benchmarks/contenders.h"

#include "benchmarks/report.h"

namespace cutproof::benchmarks {

const char* name_of(Precision precision) { return precision == Precision::binary64 ? "double" : "single"; }

Contender make_contender(const std::string& backend) {
  return {&require_timed_backend(backend), make_timed_backend(backend)};
}

}  // namespace cutproof::benchmarks
