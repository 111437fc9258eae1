#include "model/io/json_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <vector>

#include "model/error.h"
#include "model/io/input_file.h"

namespace cutproof::io {
namespace {

using nlohmann::json;

// "line 3, column 5" of the byte with this number, from 1.
std::string position_text(const std::string& text, std::size_t byte) {
  const std::size_t end = std::min(byte == 0 ? 0 : byte - 1, text.size());
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n');
  const std::size_t newline = end == 0 ? std::string::npos : text.rfind('\n', end - 1);
  const std::size_t column = newline == std::string::npos ? end + 1 : end - newline;
  return fmt::format("line {}, column {}", line, column);
}

// Counts what the text would become, without making it: brackets and separators outside of texts. In a text that is not
// JSON it counts at most too many, and never fewer than the parser makes before it stops.
void require_within(const std::string& text, const std::string& file, const JsonLimits& limits) {
  constexpr const char* kRemedy =
      "Check that this is the intended file, or make it smaller (docs/reference/limits.md).";
  if (text.size() > limits.bytes) {
    throw InputError(
        file, "",
        fmt::format("There are {} bytes. {} has at most {}.", text.size(), limits.what, bytes_text(limits.bytes)),
        kRemedy);
  }
  int64_t depth = 0, values = 1;
  bool in_text = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (in_text) {
      k += c == '\\' ? 1 : 0;
      in_text = c != '"';
      continue;
    }
    in_text = c == '"';
    depth += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    values += c == '[' || c == '{' || c == ',' || c == ':' ? 1 : 0;
    if (depth > limits.depth) {
      throw InputError(file, position_text(text, k + 1),
                       fmt::format("Brackets are nested too deeply. {} has at most {} within each other.", limits.what,
                                   limits.depth),
                       "Nest less deeply: of shapes within shapes, at most 30.");
    }
    if (values > limits.values) {
      throw InputError(file, position_text(text, k + 1),
                       fmt::format("There are too many values. {} has at most {}.", limits.what, limits.values),
                       kRemedy);
    }
  }
}

// Follows the parser, so that errors can say in which field they are, and refuses a field that is given twice.
class PathTracker {
 public:
  explicit PathTracker(std::string file) : file_(std::move(file)) {}

  bool operator()(int, json::parse_event_t event, json& parsed) {
    using Event = json::parse_event_t;
    switch (event) {
      case Event::object_start:
      case Event::array_start:
        next_entry();
        levels_.push_back({event == Event::array_start, -1, "", {}});
        break;
      case Event::object_end:
      case Event::array_end:
        levels_.pop_back();
        break;
      case Event::key: {
        Level& level = levels_.back();
        level.key = parsed.get<std::string>();
        if (!level.keys.insert(level.key).second) {
          throw InputError(file_, path(), "This field is given twice.", "Keep one of the two.");
        }
        break;
      }
      case Event::value:
        next_entry();
        break;
    }
    return true;
  }

  std::string path() const {
    std::string text;
    for (const Level& level : levels_) {
      if (level.list) {
        if (level.index >= 0) text += fmt::format("[{}]", level.index);
      } else if (!level.key.empty()) {
        text = join(text, level.key);
      }
    }
    return text;
  }

 private:
  struct Level {
    bool list;
    int64_t index;
    std::string key;
    std::set<std::string> keys;
  };
  void next_entry() {
    if (!levels_.empty() && levels_.back().list) ++levels_.back().index;
  }
  std::string file_;
  std::vector<Level> levels_;
};

// The sentence in a message of the library, without its number and position.
std::string parser_message(const std::string& what) {
  const std::size_t column = what.find("column ");
  const std::size_t start = what.find(": ", column == std::string::npos ? 0 : column);
  return shortened(start == std::string::npos ? what : what.substr(start + 2), 300);
}

}  // namespace

std::string join(const std::string& path, std::string_view name) {
  return path.empty() ? std::string(name) : fmt::format("{}.{}", path, name);
}

json parse_json(const std::string& text, const std::string& file, const JsonLimits& limits, const std::string& remedy) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    throw InputError(file, "", "The file is empty or incomplete.", remedy);
  require_within(text, file, limits);
  PathTracker tracker(file);
  try {
    return json::parse(text, std::ref(tracker));
  } catch (const json::parse_error& error) {
    const std::string message = parser_message(error.what());
    const std::size_t quoted = message.find("last read: ");
    const std::string last = quoted == std::string::npos ? "" : message.substr(quoted);
    const bool is_no_number = last.find_first_of("NI") != std::string::npos || last.find("na'") != std::string::npos ||
                              last.find("inf") != std::string::npos;
    if (error.byte > text.size()) {
      throw InputError(file, position_text(text, error.byte),
                       fmt::format("This is not valid JSON, or incomplete: {}.", message),
                       "Close what is open at the end, or copy the file again. " + remedy);
    }
    throw InputError(
        file, position_text(text, error.byte), fmt::format("This is not valid JSON: {}.", message),
        is_no_number
            ? "JSON has neither NaN nor Infinity: give a finite number."
            : "Correct the JSON there: fields are \"name\": value, separated by commas, without comments. " + remedy);
  } catch (const json::out_of_range& error) {
    const std::string what = error.what();
    const std::size_t quote = what.find('\'');
    throw InputError(file, tracker.path(),
                     fmt::format("The number{} is out of range: no finite number is that large.",
                                 quote == std::string::npos ? "" : " " + shortened(what.substr(quote), 100)),
                     "Give a finite number below 1e308.");
  }
}

json read_json(const std::string& file, const JsonLimits& limits, const std::string& remedy) {
  return parse_json(read_file(file, limits), file, limits, remedy);
}

}  // namespace cutproof::io
