#include "property_tests/counterexample.h"

#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "model/error.h"
#include "model/io/input_file.h"
#include "model/io/json_number.h"
#include "model/io/json_reader.h"
#include "model/io/json_text.h"

namespace cutproof::property_tests {
namespace {

constexpr const char* kFormat = "cutproof.counterexample";
constexpr int kVersion = 1;
constexpr const char* kWhatToGive = "give a file that `cutproof fuzz` has saved";

}  // namespace

std::string to_json(const Counterexample& counterexample) {
  nlohmann::json choices = nlohmann::json::array();
  for (std::size_t k = 0; k < counterexample.schedule.size(); ++k) {
    if (counterexample.schedule[k] != 0) choices.push_back({k, counterexample.schedule[k]});
  }
  nlohmann::json document = {{"format", kFormat},
                             {"format_version", kVersion},
                             {"backend", counterexample.backend},
                             {"schedule", choices},
                             {"found", counterexample.found},
                             {"seed", counterexample.seed},
                             {"index", counterexample.index},
                             {"case", nlohmann::json::parse(to_json(counterexample.failing))}};
  for (const Command& command : counterexample.commands) {
    document["commands"].push_back(nlohmann::json::parse(to_json(command)));
  }
  return io::json_text(document);
}

namespace {

// Cases and commands have whole numbers but for the spacing: any other, read as an integer, would become anything
// (json_number.h). Throws InputError, naming the field.
void require_whole_numbers(const nlohmann::json& document, const std::string& file) {
  for (const auto& [key, value] : document.items()) {
    const bool may_be = document.is_object() && key == "spacing";
    if (value.is_number_float() && !may_be)
      throw InputError(file, key, value.dump() + " is no whole number", kWhatToGive);
    if (value.is_structured()) require_whole_numbers(value, file);
  }
}

}  // namespace

Counterexample counterexample_from_json(const std::string& text, const std::string& file) {
  const auto refuse = [&](const std::string& field, const std::string& problem) -> InputError {
    return {file, field, problem, kWhatToGive};
  };
  Counterexample result;
  std::string field;
  try {
    const auto document = io::parse_json(text, file, io::kCounterexampleLimits, std::string(kWhatToGive) + ".");
    if (!document.is_object()) throw refuse("", "this is not a counterexample");
    require_whole_numbers(document, file);
    if (!document.contains("format")) {
      result.failing = from_json(text);
      return result;
    }
    const auto get = [&]<class T>(const char* name, T& value) {
      field = name;
      if constexpr (std::is_integral_v<T>) {
        value = integer_from<T>(document.at(name));
      } else {
        document.at(name).get_to(value);
      }
    };
    std::string format;
    int version = 0;
    get("format", format);
    if (format != kFormat) throw refuse("format", "'" + format + "' is not '" + kFormat + "'");
    get("format_version", version);
    if (version != kVersion) {
      throw refuse("format_version", "version " + std::to_string(version) + " is not known here, only " +
                                         std::to_string(kVersion) + " is");
    }
    get("backend", result.backend);
    get("found", result.found);
    get("seed", result.seed);
    get("index", result.index);
    field = "schedule";
    for (const auto& pair : document.at("schedule").get<std::vector<std::array<nlohmann::json, 2>>>()) {
      const auto decision = integer_from<std::size_t>(pair[0]);
      const auto choice = integer_from<uint16_t>(pair[1]);
      if (decision >= io::kMostDecisions)
        throw refuse("schedule", "a decision with number " + std::to_string(decision));
      if (decision >= result.schedule.size()) result.schedule.resize(decision + 1, 0);
      result.schedule[decision] = choice;
    }
    field = "case";
    result.failing = from_json(document.at("case").dump());
    field = "commands";
    if (document.contains("commands")) result.commands = commands_from_json(document.at("commands").dump());
    if (!result.commands.empty() && result.failing.together != 1) {
      throw refuse("case.together", "the case of a history must have one stroke a frame, not " +
                                        std::to_string(result.failing.together));
    }
    return result;
  } catch (const nlohmann::json::exception& error) {
    throw refuse(field, error.what());
  } catch (const std::invalid_argument& error) {
    throw refuse(field, error.what());
  }
}

Counterexample read_counterexample(const std::string& file) {
  return counterexample_from_json(io::read_file(file, io::kCounterexampleLimits), file);
}

}  // namespace cutproof::property_tests
