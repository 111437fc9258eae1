// What the machine can do at best, measured in the same run as what is told as a multiple of it.
#pragma once
#include <optional>
#include <string>

namespace cutproof::cli {

struct MachineFloors {
  double copy_bytes_per_second = 0;          // read + written
  std::optional<double> graph_node_seconds;  // device only
  std::optional<double> chain_seconds;       // of a graph of 40 empty kernels; device only
};

// By the device, or by as many threads of the CPU as the backend uses.
MachineFloors measure_machine(const std::string& backend);

}  // namespace cutproof::cli
