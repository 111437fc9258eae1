// Prints the cost of the launch layer as JSON. Usage: raw_baseline [PARTICLES [LAUNCHES]]
// Exit status: 0; 2: wrong arguments; 3: no device, or CUDA failed.
#include <cstdio>
#include <exception>
#include <string>

#include "benchmarks/raw_baseline.h"
#include "model/error.h"

int main(int argc, char** argv) {
  try {
    const long long particles = argc > 1 ? std::stoll(argv[1]) : 1'000'000;
    const int launches = argc > 2 ? std::stoi(argv[2]) : 200;
    if (argc > 3 || particles < 1 || particles > 100'000'000 || launches < 1) throw std::invalid_argument("range");
    std::puts(cutproof::gpu::raw_baseline_json(cutproof::gpu::compare_with_raw(particles, launches)).c_str());
    return 0;
  } catch (const cutproof::MachineError& error) {
    std::fprintf(stderr, "raw_baseline: %s\n", error.what());
    return 3;
  } catch (const std::exception&) {
    std::fputs("usage: raw_baseline [PARTICLES (1 to 100000000) [LAUNCHES]]\n", stderr);
    return 2;
  }
}
