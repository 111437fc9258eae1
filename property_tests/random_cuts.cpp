// Random cuts at scale: many bodies in one load, every stage judged by every oracle and compared with the reference.
//
//   random_cuts --backend reference|host|simulated|gpu --cases N [--seed S] [--size Z] [--batch B] [--threads T]
//               [--json F] [--save FOLDER]
//
// Case k is draw_case(seed + k, size of k): the same cases for the same seed, whatever the batch. Stops at the first
// failure, saves it as JSON that the property tests replay, and says so in one line. Exit status: 0 all hold, 1 one
// does not, 2 bad usage, 3 the machine failed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "gpu/backends.h"
#include "model/error.h"
#include "property_tests/dissection.h"
#include "reference_cpu/reference.h"

namespace cutproof::property_tests {
namespace {

struct Options {
  std::string backend = "host";
  int64_t cases = 1000;
  uint64_t seed = 1;
  int size = 80;      // sizes 0 .. size - 1 take turns (cases.h: up to 100)
  int batch = 64;     // bodies in one load
  int threads = 0;    // that judge; 0: as many as the machine has
  int thorough = 50;  // every so manieth case with CGAL's geometric check
  std::string split = "blocks";
  bool eager = false;  // gpu: kernels one by one instead of as a graph (compute-sanitizer's racecheck needs it)
  std::string json, save = ".";
};

std::unique_ptr<Backend> make_backend(const Options& options, uint64_t load) {
  gpu::KernelOptions kernels;
  kernels.split = options.split == "global" ? gpu::SplitMethod::global_labels : gpu::SplitMethod::blocks;
  kernels.eager = options.eager;
  if (options.backend == "reference") return reference::make_backend();
  if (options.backend == "host") return gpu::make_host_backend(options.threads, kernels);
  if (options.backend == "simulated") {
    // Schedules take turns as loads do.
    gpu::HostLauncher::Simulated simulation;
    switch (load % 4) {
      case 0:
        simulation.schedule = gpu::random_walk(options.seed + load);
        break;
      case 1:
        simulation.schedule = gpu::pct(options.seed + load, 3, 100'000);
        break;
      case 2:
        simulation.schedule = gpu::reverse();
        break;
      default:
        simulation.schedule = gpu::round_robin();
        break;
    }
    return gpu::make_simulated_backend(std::move(simulation), kernels);
  }
#if CUTPROOF_HAS_CUDA
  if (options.backend == "gpu") return gpu::make_gpu_backend(kernels);
#endif
  throw InputError("command line", "--backend", fmt::format("there is no backend '{}' in this build", options.backend),
                   "use reference, host or simulated, or gpu where a CUDA toolkit was there");
}

struct Failure {
  int64_t index = 0;
  Case failing;
  Verdict verdict;
};

struct Campaign {
  int64_t done = 0, verdicts = 0;
  std::array<int64_t, kHappenedCount> happened = {};
  std::optional<Failure> failure;
};

Case case_at(const Options& options, int64_t index) {
  return draw_case(options.seed + static_cast<uint64_t>(index), static_cast<int>(index % options.size));
}

void judge_batch(const Options& options, int64_t first, const std::vector<Case>& cases,
                 const std::vector<Loaded>& loaded, const std::vector<Trail>& trails, Campaign& campaign) {
  std::atomic<std::size_t> next{0};
  std::mutex guard;
  std::vector<std::thread> judges;
  for (int t = 0; t < options.threads; ++t) {
    judges.emplace_back([&] {
      for (std::size_t k; (k = next++) < cases.size();) {
        const int64_t index = first + static_cast<int64_t>(k);
        const bool thorough = index % options.thorough == 0;
        const Judgement judgement = judge_trail(cases[k], loaded[k], trails[k], options.backend, thorough);
        const std::lock_guard lock(guard);
        ++campaign.done;
        campaign.verdicts += judgement.verdicts;
        for (std::size_t h = 0; h < kHappenedCount; ++h) campaign.happened[h] += judgement.happened[h];
        if (judgement.failure && (!campaign.failure || index < campaign.failure->index)) {
          campaign.failure = Failure{index, cases[k], *judgement.failure};
        }
      }
    });
  }
  for (std::thread& judge : judges) judge.join();
}

int run(Options options) {
  if (options.threads <= 0) options.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  fmt::print("random cuts: backend {}, {} cases from seed {}, {} bodies a load, {} judges\n", options.backend,
             options.cases, options.seed, options.batch, options.threads);
  Campaign campaign;
  std::unique_ptr<Backend> backend;
  double simulated_seconds = 0, judged_seconds = 0;
  const auto now = [] { return std::chrono::steady_clock::now(); };
  const auto seconds = [](auto duration) { return std::chrono::duration<double>(duration).count(); };
  const auto begin = now();
  for (int64_t first = 0; first < options.cases && !campaign.failure; first += options.batch) {
    std::vector<Case> cases;
    std::vector<Loaded> loaded;
    for (int64_t index = first; index < std::min<int64_t>(first + options.batch, options.cases); ++index) {
      cases.push_back(case_at(options, index));
      loaded.push_back(load(cases.back()));
    }
    if (!backend || options.backend == "simulated") {
      backend = make_backend(options, static_cast<uint64_t>(first / options.batch));
    }
    const auto since = now();
    const std::vector<Trail> trails = run_cases(*backend, loaded);
    simulated_seconds += seconds(now() - since);
    const auto judging = now();
    judge_batch(options, first, cases, loaded, trails, campaign);
    judged_seconds += seconds(now() - judging);
  }
  const double total = seconds(now() - begin);
  const double rate = static_cast<double>(campaign.done) / total;

  std::string empty;
  for (std::size_t h = 0; h < kHappenedCount; ++h) {
    fmt::print("  {:<28} {:>9}\n", kHappenedNames[h], campaign.happened[h]);
    if (campaign.happened[h] == 0) empty += std::string(empty.empty() ? "" : ", ") + kHappenedNames[h];
  }
  fmt::print("{} cases, {} verdicts, {:.1f} s, {:.0f} cases/s (running {:.1f} s, judging {:.1f} s)\n", campaign.done,
             campaign.verdicts, total, rate, simulated_seconds, judged_seconds);
  if (!options.json.empty()) {
    nlohmann::json result = {{"format", "cutproof.random_cuts"},
                             {"format_version", 1},
                             {"backend", options.backend},
                             {"split", options.split},
                             {"seed", options.seed},
                             {"size", options.size},
                             {"batch", options.batch},
                             {"cases", campaign.done},
                             {"verdicts", campaign.verdicts},
                             {"seconds", total},
                             {"cases_per_second", rate},
                             {"holds", !campaign.failure},
                             {"happened", nlohmann::json::object()}};
    for (std::size_t h = 0; h < kHappenedCount; ++h) result["happened"][kHappenedNames[h]] = campaign.happened[h];
    std::ofstream(options.json) << result.dump(1) << "\n";
  }
  if (campaign.failure) {
    const std::string file = fmt::format("{}/random_cut_{}.json", options.save,
                                         options.seed + static_cast<uint64_t>(campaign.failure->index));
    std::ofstream(file) << to_json(campaign.failure->failing) << "\n";
    fmt::print("FAILS: case {}: {}\nsaved as {}; alone again: random_cuts --backend {} --replay {}\n",
               campaign.failure->index, describe(campaign.failure->verdict), file, options.backend, file);
    return 1;
  }
  // Too few cases need not meet every class; many that never meet one test nothing there.
  if (options.cases >= 1000 && options.size >= 80 && !empty.empty()) {
    fmt::print("FAILS: no case had: {}\n", empty);
    return 1;
  }
  fmt::print("all hold\n");
  return 0;
}

int replay(Options options, const std::string& file) {
  options.threads = 1;
  std::ifstream stream(file);
  if (!stream) throw InputError(file, "", "the file cannot be read", "give a file that random_cuts has saved");
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  Case c;
  try {
    c = from_json(text);
  } catch (const std::invalid_argument& error) {
    throw InputError(file, "", error.what(), "give a file that random_cuts has saved");
  }
  const auto backend = make_backend(options, 0);
  const Judgement judgement = dissect(*backend, c, true);
  fmt::print("{}\n", judgement.failure ? "FAILS: " + describe(*judgement.failure) : "holds");
  return judgement.failure ? 1 : 0;
}

}  // namespace
}  // namespace cutproof::property_tests

int main(int argc, char** argv) {
  using namespace cutproof;
  property_tests::Options options;
  std::string replayed;
  CLI::App app{"Random cuts on a backend, judged by every oracle."};
  app.add_option("--backend", options.backend)->capture_default_str();
  app.add_option("--cases", options.cases)->capture_default_str()->check(CLI::NonNegativeNumber);
  app.add_option("--seed", options.seed)->capture_default_str();
  app.add_option("--size", options.size)->capture_default_str()->check(CLI::Range(1, 101));
  app.add_option("--batch", options.batch)->capture_default_str()->check(CLI::Range(1, 100000));
  app.add_option("--threads", options.threads);
  app.add_option("--split", options.split)->check(CLI::IsMember({"blocks", "global"}))->capture_default_str();
  app.add_flag("--eager", options.eager);
  app.add_option("--json", options.json);
  app.add_option("--save", options.save)->capture_default_str();
  app.add_option("--replay", replayed);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& asked) {
    return app.exit(asked);
  } catch (const CLI::ParseError& error) {
    app.exit(error);
    return 2;
  }
  try {
    return replayed.empty() ? property_tests::run(options) : property_tests::replay(options, replayed);
  } catch (const InputError& error) {
    fmt::print(stderr, "random_cuts: {}\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    fmt::print(stderr, "random_cuts: {}\n", error.what());
    return 3;
  }
}
