// The page without its contents, as the build has put it together (report/embed.py). All are empty in a build without
// esbuild or three.js.
#pragma once
#include <string_view>

namespace cutproof::report {

// With marks where contents belong: @STYLE@, @SCRIPT@, @DATA@ and so on.
extern const std::string_view kPageHtml;
extern const std::string_view kPageStyle, kPageStyleHash;    // the hash as a Content-Security-Policy names it
extern const std::string_view kPageScript, kPageScriptHash;  // "sha256-..."

}  // namespace cutproof::report
