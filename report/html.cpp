#include "report/html.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "report/assets.h"

namespace cutproof::report {

namespace {

// The template with its marks replaced, each by what may hold any text: nothing in it is looked at again.
std::string filled(std::string_view page, const std::vector<std::pair<std::string_view, std::string_view>>& contents) {
  std::string text;
  while (!page.empty()) {
    std::size_t first = std::string_view::npos;
    const std::pair<std::string_view, std::string_view>* next = nullptr;
    for (const auto& content : contents) {
      const std::size_t found = page.find(content.first);
      if (found < first) {
        first = found;
        next = &content;
      }
    }
    text += page.substr(0, first);
    if (next == nullptr) break;
    text += next->second;
    page.remove_prefix(first + next->first.size());
  }
  return text;
}

}  // namespace

nlohmann::json to_json(const Made& made) {
  return {{"program", made.program},
          {"command", made.command},
          {"date", made.date},
          {"machine", made.machine},
          {"commit", made.commit}};
}

std::string html(const std::string& data, const std::vector<std::string>& chunks,
                 const std::vector<std::string>& beside) {
  std::string later;
  const auto add = [&](const char* name, std::size_t k, const std::string& chunk) {
    later += fmt::format("<script type=\"application/octet-stream\" id=\"{}-{}\">", name, k);
    later += chunk;
    later += "</script>\n";
  };
  // In the order in which they are looked at: of both runs what belongs to the same moments.
  for (std::size_t k = 0; k < std::max(chunks.size(), beside.size()); ++k) {
    if (k > 0 && k < chunks.size()) add("chunk", k, chunks[k]);
    if (k < beside.size()) add("beside", k, beside[k]);
  }
  return filled(kPageHtml, {{"@STYLE_HASH@", kPageStyleHash},
                            {"@SCRIPT_HASH@", kPageScriptHash},
                            {"@STYLE@", kPageStyle},
                            {"@SCRIPT@", kPageScript},
                            {"@DATA@", data},
                            {"@FIRST_CHUNK@", chunks.empty() ? std::string_view() : chunks.front()},
                            {"@LATER_CHUNKS@", later}});
}

}  // namespace cutproof::report
