// `cutproof tune`: the cheapest configuration of a scene within a tolerance (guide.md, Tuning).
#include "tuning/tune.h"

#include <fmt/format.h>

#include <filesystem>
#include <memory>

#include "cli/commands.h"
#include "cli/options.h"
#include "cli/output.h"
#include "cli/table.h"
#include "model/rules.h"

namespace cutproof::cli {

namespace {

using benchmarks::Times;
using namespace tuning;

struct Asked {
  TuneOptions tune;
  std::string reference = "limit";
  std::string json;
};

// The default name of the scene that is written. Throws InputError if two of the three files are one.
void settle_files(Asked& asked) {
  namespace fs = std::filesystem;
  TuneOptions& options = asked.tune;
  if (options.write.empty()) options.write = fs::path(options.scene).stem().string() + "_tuned.json";
  const auto same = [](const fs::path& a, const fs::path& b) {
    std::error_code error;
    return fs::weakly_canonical(a, error) == fs::weakly_canonical(b, error);
  };
  const auto require_other = [&](const char* option, const std::string& file, const std::string& other,
                                 const char* what) {
    if (!file.empty() && same(file, other)) refuse(option, fmt::format("'{}' is {}", file, what), "give another name");
  };
  require_other("--write", options.write, options.scene, "the scene that is tuned");
  require_other("--json", asked.json, options.scene, "the scene that is tuned");
  require_other("--json", asked.json, options.write, "the scene that is written");
  require_writable(asked.json);
  require_writable(options.write);
}

void print_beginning(const TuneResult& result) {
  fmt::print("{} on {}, {}\n", result.provenance.backend, result.provenance.device, result.provenance.date);
  fmt::print("scene {}: {}\n", result.given.scene.name, result.given.scene.description);
  if (result.skin_is_expected) fmt::print("--without-skin does nothing: the scene expects shells of its skin\n");
}

void print_reference(const TuneResult& result) {
  fmt::print("the reference solution: {}\n", result.options.reference == ReferenceKind::limit
                                                 ? "the limit of short time steps"
                                                 : "the scene's own substeps, each solved until converged");
  for (const RefinementLevel& level : result.levels) {
    fmt::print("  reference, {} × {}{}\n", level.substeps, level.iterations,
               level.apart_h ? fmt::format(": {:.2g} h from the one before", *level.apart_h) : "");
  }
}

void print_trials(const TuneResult& result) {
  Table table({"substeps × iterations", "acceleration", "RMS h", "max h", "removed otherwise", "ms a frame", "of given",
               "outcome", "else"});
  const double given = result.trials.front().frame.median;
  for (const Trial& trial : result.trials) {
    const StepParameters& step = trial.configuration.scene.step;
    const bool timed = trial.frame.count > 0;
    std::string other = differences(trial.configuration, result.given);
    if (!trial.why.empty()) other += (other.empty() ? "" : "; ") + trial.why;
    table.add({fmt::format("{} × {}", step.substeps, step.iterations), std::string(name_of(step.acceleration)),
               fmt::format("{:.2g}", trial.greatest_rms_h), fmt::format("{:.2g}", trial.greatest_h),
               fmt::format("{}", trial.removed_otherwise),
               timed ? fmt::format("{:.3f}", 1e3 * trial.frame.median) : "-",
               timed ? fmt::format("{:.2f}", trial.frame.median / given) : "-", name_of(trial.outcome), other});
  }
  fmt::print("\n{}", table.text());
}

void print_not_taken(const TuneResult& result) {
  const auto& [trial, why] = result.not_taken.back();
  const StepParameters& step = result.trials[trial].configuration.scene.step;
  fmt::print("{} × {}, acceleration {}, is not taken: {}\n", step.substeps, step.iterations, name_of(step.acceleration),
             why);
}

std::string ms_and_range(const Times& times) {
  return fmt::format("{:.3f} ({:.3f} to {:.3f})", 1e3 * times.median, 1e3 * times.min, 1e3 * times.max);
}

void print_found(const TuneResult& result) {
  const TuneResult::Found& found = *result.found;
  const Configuration& configuration = result.trials[found.trial].configuration;
  const StepParameters& step = configuration.scene.step;
  const auto& [given, tuned] = found.times;
  const std::string other = differences(configuration, result.given);
  if (found.trial == 0) {
    fmt::print(
        "\nfound: nothing that is cheaper; the scene as it was given is within the tolerance\n"
        "  {:.3f} ms a frame ({:.3f} to {:.3f})\n",
        1e3 * given.median, 1e3 * given.min, 1e3 * given.max);
  } else {
    const double ratio = given.median / tuned.median;
    fmt::print(
        "\nfound: {} × {}, acceleration {}{}\n"
        "  {:.3f} ms a frame ({:.3f} to {:.3f}), as given {}: {}\n",
        step.substeps, step.iterations, name_of(step.acceleration), other.empty() ? "" : ", " + other,
        1e3 * tuned.median, 1e3 * tuned.min, 1e3 * tuned.max, ms_and_range(given),
        ratio >= 1 ? fmt::format("{:.2f} times cheaper", ratio)
                   : fmt::format("{:.2f} times as expensive, and what was given is not within", 1 / ratio));
  }
  const RefinementLevel& finest = result.levels.back();
  fmt::print(
      "  verified: RMS {:.2g} h, max {:.2g} h from the reference's {} × {}, {:.2g} h from the one before; "
      "{} verdicts hold\nwrote {}\n",
      found.verified.trial.greatest_rms_h, found.verified.trial.greatest_h, finest.substeps, finest.iterations,
      result.known_to_h, found.verified.verdicts, result.options.write);
  if (configuration.rotation != result.given.rotation) {
    fmt::print("  rotations are no part of a scene: run it with --rotation {}\n", configuration.rotation);
  }
  if (result.options.frames) {
    fmt::print("  the scene was written whole, and looked at for {} frames only\n", *result.options.frames);
  }
}

void print_conclusion(const TuneResult& result) {
  const double tolerance = result.options.tolerance;
  switch (*result.conclusion) {
    case TuneResult::Conclusion::found:
      return print_found(result);
    case TuneResult::Conclusion::reference_unknown:
      fmt::print(
          "the reference solution is known to {:.2g} h only, so nothing can be said to be within {:g} h of it.\n"
          "  Give a greater tolerance{}.\n",
          result.known_to_h, tolerance,
          result.options.reference == ReferenceKind::limit
              ? ", fewer --frames, or --reference substeps, which takes the scene's time step as given"
              : " or fewer --frames");
      return;
    case TuneResult::Conclusion::none_within:
      fmt::print("none of {} configurations is within {:g} h of the reference solution, itself known to {:.2g} h\n",
                 result.trials.size(), tolerance, result.known_to_h);
      return;
    case TuneResult::Conclusion::none_verified:
      fmt::print("none of the configurations that seemed to be within {:g} h holds when it is verified\n", tolerance);
  }
}

void print(const TuneResult& result, TuneStep step) {
  switch (step) {
    case TuneStep::begun:
      return print_beginning(result);
    case TuneStep::reference_known:
      return print_reference(result);
    case TuneStep::trial:
      return;
    case TuneStep::searched:
      return print_trials(result);
    case TuneStep::not_taken:
      return print_not_taken(result);
    case TuneStep::concluded:
      return print_conclusion(result);
  }
}

int tune(Asked asked) {
  asked.tune.reference = asked.reference == "limit" ? ReferenceKind::limit : ReferenceKind::substeps;
  settle_files(asked);
  const TuneResult result = run_tune(asked.tune, [&](const TuneResult& so_far, TuneStep step) {
    print(so_far, step);
    flush_output();
    // After each trial, so that what has been measured is kept if a later one fails.
    if (step == TuneStep::trial || step == TuneStep::concluded) write_document(asked.json, to_json(so_far));
  });
  if (!asked.json.empty()) fmt::print("wrote {}\n", asked.json);
  return result.conclusion == TuneResult::Conclusion::found ? 0 : 1;
}

}  // namespace

void add_tune(CLI::App& program, Work& work) {
  const auto asked = std::make_shared<Asked>();
  TuneOptions& options = asked->tune;
  CLI::App* const command =
      program.add_subcommand("tune", "find the cheapest configuration of a scene within a tolerance");
  command->add_option("scene", options.scene, "scene file (JSON); see `cutproof info --scene`")
      ->required()
      ->type_name("SCENE");
  command
      ->add_option("--tolerance", options.tolerance,
                   "greatest RMS distance from the reference solution in any frame [h]")
      ->required()
      ->type_name("T")
      ->check(CLI::PositiveNumber);
  command
      ->add_option("--reference", asked->reference,
                   "the reference solution. limit: of ever shorter time steps; substeps: the scene's own, each solved "
                   "until it is converged")
      ->capture_default_str()
      ->type_name("R")
      ->check(CLI::IsMember({"limit", "substeps"}));
  add_backend(*command, options.backend, "backend under test", is_timed);
  command->add_option("--frames", options.frames, "look at this many frames of the scene only")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command->add_flag("--without-skin", options.without_skin, "nobody looks at the skin: it need not be made");
  command->add_flag("--full", options.full,
                    "run and time everything to its end, for a curve; else what is beyond the tolerance, or more "
                    "expensive than what was found, is given up");
  command->add_option("--repeats", options.repeats, "timed runs of each configuration")
      ->capture_default_str()
      ->type_name("N")
      ->check(CLI::Range(1, 1000));
  command->add_option("--write", options.write, "the scene that was found (default: NAME_tuned.json here)")
      ->type_name("F");
  add_json(*command, asked->json, "write everything that was tried");
  command->callback([asked, &work] { work = [asked] { return tune(*asked); }; });
}

}  // namespace cutproof::cli
