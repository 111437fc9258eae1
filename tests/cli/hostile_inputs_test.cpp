// What a hostile file, or an unlucky one, can do to the program: nothing. A table that anyone can extend: a row says
// how to make the file "input" (or another that the arguments name), what is run, and what the error must say. Each run
// must end by itself with exit status 2 and a remedy, must print nothing that acts on a terminal, write nothing, and
// stay within most_memory(). What time it takes of a processor is told in the log, and asserted nowhere; who takes
// kMostSeconds hangs.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "model/io/limits.h"
#include "model/printable.h"
#include "tests/program.h"

namespace cutproof::tests::hostile_inputs_test {
namespace {

constexpr unsigned kMostSeconds = 60;

// Every path here is in the folder of the test, which the run has as its own.
struct Hostile {
  const char* name;
  std::function<void()> make;
  const char* arguments;
  std::vector<std::string> words;  // of the error
};

// Piece by piece, so that this process stays small: a child's memory is counted from that of its parent.
class Writer {
 public:
  explicit Writer(const std::string& name = "input") : file_(name, std::ios::binary) {}
  Writer& operator()(std::string_view text, std::size_t times = 1) {
    for (; times > 0; --times) file_.write(text.data(), static_cast<std::streamsize>(text.size()));
    return *this;
  }

 private:
  std::ofstream file_;
};

std::function<void()> text(const std::string& content) {
  return [content] { Writer()(content); };
}
// `before`, a piece many times, `after`.
std::function<void()> repeated(const std::string& before, const std::string& piece, std::size_t times,
                               const std::string& after) {
  return [=] { Writer()(before)(piece, times)(after); };
}
// A scene whose body is a small box, but for what follows.
const std::string kScene =
    R"({"version": 5, "frame": {"count": 1}, "body": {"spacing": 0.02, "shape": {"kind": "box"}})";

void run_shell(const std::string& command) {
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command);
}
// By Python, with numpy and h5py: the input is to be written as "input.npz" or "input.h5".
std::function<void()> python(const std::string& program) {
  return [program] {
    Writer("make.py")("import numpy as np, h5py, zipfile, struct\n" + program);
    run_shell("/usr/bin/python3 make.py");
    files::remove("make.py");
  };
}
// A run, "run": save(k, name=array, …) writes segment k, and x is a place for positions of two particles.
std::function<void()> folder_of_a_run(const std::string& program) {
  return python(
      "import os\nos.mkdir('run')\nx = np.zeros((1, 2, 3))\n"
      "def save(k, **arrays): np.savez(f'run/{k:06}.npz', **({'positions': x} | arrays))\n" +
      program);
}
// A run, "input.h5", as f; the same x.
std::function<void()> hdf5_of_a_run(const std::string& program) {
  return python("x = np.zeros((1, 2, 3))\nf = h5py.File('input.h5', 'w')\n" + program);
}
// A recording, "input.cutproof.h5", whose index is then changed.
std::function<void()> changed_recording(const std::string& program) {
  return [program] {
    Writer("scene.json")(kScene + "}");
    run_shell("'" CUTPROOF_PROGRAM "' run scene.json --record input > /dev/null");
    python("f = h5py.File('input.cutproof.h5', 'r+')\n" + program)();
  };
}
void make_socket() {
  const int made = socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address = {};
  address.sun_family = AF_UNIX;
  std::string("input").copy(address.sun_path, sizeof address.sun_path - 1);
  if (bind(made, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) throw std::runtime_error("bind");
  close(made);
}
void make_pipe() {
  if (mkfifo("input", 0600) != 0) throw std::runtime_error("mkfifo");
}
std::function<void()> sparse(const std::string& name) {
  return [name] {
    Writer{name};
    files::resize_file(name, uintmax_t{1} << 40);
  };
}
void nothing() {}

const std::vector<Hostile>& hostile_inputs() {
  static const std::vector<Hostile> all = {
      // --- What is no file
      {"APipeForAScene", make_pipe, "run input", {"input", "a pipe"}},
      {"ASocketForAScene", make_socket, "run input", {"a socket"}},
      {"AFolderForAScene", [] { files::create_directory("input"); }, "run input", {"a folder"}},
      {"ADeviceForAScene", nothing, "run /dev/zero", {"/dev/zero", "a device"}},
      {"ATerminalForAScene", nothing, "run /dev/tty", {"/dev/tty", "a device"}},
      {"NothingForAScene", nothing, "run ./input", {"no such file"}},
      {"ALinkToNothing", [] { files::create_symlink("away", "input"); }, "run ./input", {"no such file"}},
      {"ALinkToItself", [] { files::create_symlink("input", "input"); }, "run ./input", {"cannot be opened"}},
      {"APipeForStandardInput", nothing, "run /dev/stdin", {"/dev/stdin", "a pipe"}},
      {"AFileOfTheKernelWithoutASize", nothing, "run /proc/self/status", {"/proc/self/status", "not valid JSON"}},
      {"AFileOfTheKernelWithoutAnEnd", nothing, "run /proc/self/pagemap", {"/proc/self/pagemap", "too large", "4 MiB"}},
      {"APipeForACounterexample", make_pipe, "replay input", {"a pipe"}},
      {"APipeForAResult", make_pipe, "fuzz --merge input", {"a pipe"}},
      {"APipeForARecording",
       [] {
         make_pipe();
         files::rename("input", "input.cutproof.h5");
       },
       "check input.cutproof.h5",
       {"a pipe"}},
      {"APipeForArrays",
       [] {
         make_pipe();
         files::rename("input", "input.npz");
       },
       "check input.npz",
       {"a pipe"}},
      {"APipeForAKick",
       [] {
         make_pipe();
         files::rename("input", "input.npz");
       },
       "kick input.npz",
       {"a pipe"}},
      {"APipeForVectors",
       [] {
         make_pipe();
         files::rename("input", "input.npz");
       },
       "check-vectors input.npz input.npz",
       {"a pipe"}},
      {"APipeForAMesh",
       [] {
         make_pipe();
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input",
       {"a pipe"}},
      {"APipeForAPlugin", make_pipe, "judge ./input", {"not a file"}},
      {"APipeToTune", make_pipe, "tune input --tolerance 1", {"a pipe"}},

      // --- Scenes
      {"ASceneOfATerabyte", sparse("input"), "run input", {"too large", "4 MiB"}},
      {"AHundredMegabytesOfBrackets",
       repeated("", std::string(1000, '['), 100'000, ""),
       "run input",
       {"too large", "4 MiB"}},
      {"AMillionBrackets", repeated("", "[", 1'000'000, ""), "run input", {"nested too deeply", "64", "column 65"}},
      {"AMillionBracketsInTune", repeated("", "[", 1'000'000, ""), "tune input --tolerance 1", {"nested too deeply"}},
      {"AMillionObjects", repeated("", "{\"a\":", 500'000, ""), "run input", {"nested too deeply"}},
      {"AMillionEmptyLists", repeated("[", "[],", 1'000'000, "[]]"), "run input", {"too many values", "200000"}},
      {"AMillionFields",
       [] {
         Writer out;
         out("{");
         for (int k = 0; k < 400'000; ++k) out("\"" + std::to_string(k) + "\":0,");
         out("\"a\":0}");
       },
       "run input",
       {"too large"}},
      {"SixMillionPointsOfAPath",
       repeated(kScene + R"(,"blade":{"strokes":[{"points":[)", "[0,0,0],", 6'000'000, "[1,0,0]]}]}}"),
       "run input",
       {"too large"}},
      {"FortyThousandPointsOfAPath",
       repeated(kScene + R"(,"blade":{"strokes":[{"points":[)", "[0,0,0],", 40'000, "[1,0,0]]}]}}"),
       "run input",
       {"blade.strokes[0].points", "40001 entries", "10000"}},
      {"TwoThousandStrokes",
       repeated(kScene + R"(,"blade":{"strokes":[)", R"({"points":[[0,0,0],[1,0,0]]},)", 2000,
                R"({"points":[[0,0,0],[1,0,0]]}]}})"),
       "run input",
       {"blade.strokes", "2001 entries"}},
      {"AHundredThousandGrips",
       repeated(kScene + R"(,"grips":[)", R"({"low":[0,0,0],"high":[1,1,1]},)", 100'000,
                R"({"low":[0,0,0],"high":[1,1,1]}]})"),
       "run input",
       {"too many values"}},
      {"AThousandGrips",
       repeated(kScene + R"(,"grips":[)", R"({"low":[0,0,0],"high":[1,1,1]},)", 1000,
                R"({"low":[0,0,0],"high":[1,1,1]}]})"),
       "run input",
       {"grips", "1001 entries", "100"}},
      {"GripsOfTooManySubsteps",
       [] {
         Writer()(R"({"version": 5, "frame": {"count": 50000}, "step": {"substeps": 100},)")(
             R"("body": {"spacing": 0.02, "shape": {"kind": "box"}}, "grips": [)")(
             R"({"low":[0,0,0],"high":[1,1,1]},)", 9)(R"({"low":[0,0,0],"high":[1,1,1]}]})");
       },
       "run input",
       {"grips", "10 grips", "Use at most 4 grips"}},
      {"AThousandWalls",
       repeated(kScene + R"(,"walls":[)", R"({"axis":0},)", 1000, R"({"axis":0}]})"),
       "run input",
       {"walls", "1001 entries"}},
      {"AHundredThousandPartsOfAUnion",
       repeated(R"({"version":5,"body":{"spacing":1,"shape":{"kind":"union","parts":[)", R"({"kind":"ball"},)", 100'000,
                R"({"kind":"ball"}]}}})"),
       "run input",
       {"too many values"}},
      {"AThousandPartsOfAUnion",
       repeated(R"({"version":5,"body":{"spacing":1,"shape":{"kind":"union","parts":[)", R"({"kind":"ball"},)", 1000,
                R"({"kind":"ball"}]}}})"),
       "run input",
       {"body.shape.parts", "1001 entries", "100"}},
      {"ManyPartsOfManyUnions",
       repeated(R"({"version":5,"body":{"spacing":1,"shape":{"kind":"union","parts":[)",
                R"({"kind":"union","parts":[{"kind":"ball"},{"kind":"ball"},{"kind":"ball"}]},)", 50,
                R"({"kind":"ball"}]}}})"),
       "run input",
       {"body.shape", "202 shapes", "100"}},
      {"ATextOfFiftyMegabytes",
       repeated(R"({"version":5,"description":")", std::string(1000, 'a'), 50'000, "\"}"),
       "run input",
       {"too large"}},
      {"ATextOfThreeMegabytes",
       repeated(R"({"version":5,"description":")", "abc", 1'000'000, "\"}"),
       "run input",
       {"description", "3000000 bytes", "10000"}},
      {"AnUnknownFieldOfThreeMegabytes",
       repeated(R"({"version":5,")", "abc", 1'000'000, "\":0}"),
       "run input",
       {"not known here", "more bytes"}},
      {"AWordOfThreeMegabytes",
       repeated(R"({"version":5,"body":)", "abc", 1'000'000, "}"),
       "run input",
       {"not valid JSON"}},
      {"ANumberOfAMillionDigits",
       repeated(R"({"version":5,"seed":)", "9", 1'000'000, "}"),
       "run input",
       {"out of range", "more bytes"}},
      {"AFractionOfAMillionDigits",
       repeated(R"({"version":5,"frame":{"length":0.)", "0", 1'000'000, "1}}"),
       "run input",
       {"frame.length", "out of bounds"}},
      {"AnExponentOfAMillionDigits",
       repeated(R"({"version":5,"frame":{"length":1e)", "9", 1'000'000, "}}"),
       "run input",
       {"out of range"}},
      {"AFieldGivenTwice",
       text(R"({"version":5,"body":{"spacing":1,"spacing":2}})"),
       "run input",
       {"body.spacing", "given twice"}},
      {"BytesThatAreNoUtf8", text("{\"version\":5,\"name\":\"\xff\xfe\"}"), "run input", {"not valid JSON", "UTF-8"}},
      {"HalfOfASurrogatePair", text(R"({"version":5,"name":"\ud800"})"), "run input", {"not valid JSON"}},
      {"ANulInAName", text(kScene + R"(,"name":"a\u0000b"})"), "run input", {"name", "NUL"}},
      {"AnEscapeInAField", text(R"({"version":5,"\u001b]0;owned\u0007":1})"), "run input", {R"(\x1b]0;owned\x07)"}},
      {"AC1ControlInAField",
       text("{\"version\":5,\"\xc2\x9b"
            "31m\":1}"),
       "run input",
       {R"(\u009b31m)"}},
      {"ADirectionOfReadingInAField",
       text("{\"version\":5,\"\xe2\x80\xae"
            "abc\":1}"),
       "run input",
       {R"(\u202eabc)"}},
      {"ALineThatLooksLikeOurs",
       text(R"({"version":5,"x\ncutproof: all hold":1})"),
       "run input",
       {R"(x\ncutproof: all hold)"}},
      {"AnEscapeInAFileName", [] { Writer("\x1b[31minput")("{"); }, "run '\x1b[31minput'", {R"(\x1b[31minput)"}},
      {"AFileNameThatIsNoUtf8", [] { Writer("caf\xe9")("{"); }, "run 'caf\xe9'", {R"(caf\xe9)"}},
      {"ALineEndInAFileName", [] { Writer("two\nlines")("{"); }, "run 'two\nlines'", {R"(two\nlines)", "line end"}},
      {"AnEscapeInAnOption", nothing, "run '--\x1b[31m'", {R"(--\x1b[31m)", "no such option"}},
      {"AnEscapeInAVerb", nothing, "'\x1b[31mrun'", {R"(\x1b[31mrun)", "no such subcommand"}},

      // --- Counterexamples, results of campaigns, questions
      {"ACounterexampleOfATerabyte", sparse("input"), "replay input", {"too large", "8 MiB"}},
      {"ACounterexampleOfBrackets", repeated("", "[", 1'000'000, ""), "replay input", {"nested too deeply"}},
      {"ACounterexampleOfManyValues", repeated("[", "{},", 1'000'000, "0]"), "replay input", {"too many values"}},
      {"ACounterexampleWithAFieldTwice", text(R"({"format":1,"format":2})"), "replay input", {"format", "given twice"}},
      {"ACounterexampleThatIsNoJson", text("\x1b[2J"), "replay input", {"not valid JSON"}},
      {"ADecisionFarAway",
       text(R"({"format":"cutproof.counterexample","format_version":1,"backend":"","split":"","found":"","seed":1,)"
            R"("index":0,"schedule":[[99999999,1]]})"),
       "replay input",
       {"schedule", "a decision with number 99999999"}},
      {"ParticlesFarFromEachOther",
       [] {
         std::ifstream file(CUTPROOF_SOURCE "/fixtures/regressions/pair_on_a_wall.json");
         nlohmann::json document = nlohmann::json::parse(file);
         document["case"]["nodes"] = {{0, 0, 0}, {1 << 20, 1 << 20, 1 << 20}};
         Writer()(document.dump());
       },
       "replay input",
       {"case", "nodes must be nearer to each other"}},
      {"AResultOfATerabyte", sparse("input"), "fuzz --merge input", {"too large", "64 MiB"}},
      {"AResultOfBrackets", repeated("", "[", 1'000'000, ""), "fuzz --merge input", {"nested too deeply"}},
      {"AResultOfManyValues", repeated("[", "{},", 3'000'000, "0]"), "fuzz --merge input", {"too many values"}},
      {"AQuestionOfATerabyte",
       sparse("input"),
       "judge '" CUTPROOF_PLUGIN_IN_C "' --case input",
       {"too large", "32 MiB"}},
      {"AQuestionOfBrackets",
       repeated("", "[", 1'000'000, ""),
       "judge '" CUTPROOF_PLUGIN_IN_C "' --case input",
       {"nested too deeply"}},
      {"AQuestionOfManyValues",
       repeated("[", "{},", 3'000'000, "0]"),
       "judge '" CUTPROOF_PLUGIN_IN_C "' --case input",
       {"too many values"}},
      {"APluginThatIsNoUtf8",
       [] { Writer("caf\xe9.so")("x"); },
       "judge './caf\xe9.so'",
       {R"(caf\xe9.so)", "not UTF-8"}},

      // --- For a page
      {"APipeForAPage", make_pipe, "report input -o page.html", {"a pipe"}},
      {"APipeBesideARecordingForAPage",
       [] {
         make_pipe();
         files::rename("input", "pipe");
         changed_recording("")();
       },
       "report input pipe -o page.html",
       {"a pipe"}},
      {"ADocumentOfATerabyteForAPage", sparse("input"), "report input -o page.html", {"too large", "64 MiB"}},
      {"ADocumentOfBracketsForAPage",
       repeated("", "[", 1'000'000, ""),
       "report input -o page.html",
       {"nested too deeply"}},
      {"ADocumentOfManyValuesForAPage",
       repeated("[", "{},", 5'000'000, "0]"),
       "report input -o page.html",
       {"too many values"}},
      {"ADocumentThatIsNothingForAPage",
       text(R"({"format":"\u001b[31mred"})"),
       "report input -o page.html",
       {"format", R"(\x1b[31mred)"}},
      {"ACampaignOfAnotherVersionForAPage",
       text(R"({"format":"cutproof.fuzz","format_version":99})"),
       "report input -o page.html",
       {"format_version", "version 99"}},
      {"ACampaignWithoutFieldsForAPage",
       text(R"({"format":"cutproof.fuzz","format_version":4})"),
       "report input -o page.html",
       {"backend", "missing"}},
      {"ABenchmarkOfAnUnknownSuiteForAPage",
       text(
           R"({"format":"cutproof.bench","format_version":3,"suite":"\u001b[31m","backend":"","device":"","date":"","cutproof":""})"),
       "report input -o page.html",
       {"suite", R"(\x1b[31m)", "sensitivity"}},
      {"ATuningWhoseAnswerIsNoTrialForAPage",
       text(R"({"format":"cutproof.bench","format_version":3,"suite":"tune","complete":true,"backend":"","device":"",)"
            R"("date":"","cutproof":"","scene":"s","tolerance_h":1,"trials":[],"found":{"trial":7}})"),
       "report input -o page.html",
       {"found.trial", "no such trial"}},
      {"ACounterexampleOfManyNodesForAPage",
       [] {
         Writer()(R"({"format":"cutproof.counterexample","format_version":1,"case":{"nodes":[)")("[0,0,0],",
                                                                                                 600'000)("[1,0,0]]}}");
       },
       "report input -o page.html",
       {"too many values"}},

      // --- Meshes
      {"AMeshOfATerabyte",
       [] {
         sparse("input.stl")();
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.stl",
       {"too large", "256 MiB"}},
      {"AnObjOfTwoMillionFacesAndMore",
       [] {
         Writer("input.obj")("v 0 0 0\nv 1 0 0\nv 0 1 0\n")("f 1 2 3\n", 2'000'002);
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.obj",
       {"more than 2000000 faces"}},
      {"AnObjOfTwoMillionVerticesAndMore",
       [] {
         Writer("input.obj")("v 0 0 0\n", 2'000'002);
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.obj",
       {"more than 2000000 vertices"}},
      {"AnOffThatPromisesMuch",
       [] {
         Writer("input.off")("OFF\n99999999999 99999999999 0\n");
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.off",
       {"promises 99999999999 vertices"}},
      {"APlyThatPromisesMuch",
       [] {
         Writer("input.ply")("ply\nformat ascii 1.0\nelement vertex 99999999999\nproperty float x\nproperty float y\n")(
             "property float z\nelement face 9\nproperty list uchar int vertex_indices\nend_header\n");
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.ply",
       {"cut off"}},
      {"AFaceOfAMillionCorners",
       [] {
         Writer("input.obj")("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf")(" 1 2 3 4", 250'000)("\n");
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.obj",
       {"face 0", "1000000 corners"}},
      {"AnEscapeInAMesh",
       [] {
         Writer("input.obj")("\x1b[31mv 0 0 0\n");
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.obj",
       {"input.obj", "?[31mv"}},
      {"AMeshWithDecimalCommas",
       [] {
         Writer("input.obj")("v 0 0 0\nv 0,5 0 0\n");
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.obj",
       {"line 2", "decimal comma", "LC_ALL=C"}},
      {"AMeshInUtf16",
       [] {
         Writer("input.obj")(std::string("\xff\xfev\0 \0000\0", 8));
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.obj",
       {"UTF-16", "UTF-8"}},
      {"ATriangleStripThatEndsNowhere",
       [] {
         Writer("input.ply")("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n")(
             "property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n")(
             "0 0 0\n1 0 0\n0 1 0\n2000000000")(" 0 1 2", 1'000'000);
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.ply",
       {"more than 2000000 faces"}},
      {"AMeshThatRepairMakesAnotherBody",  // flat, and a shell when it is wrapped
       [] {
         Writer("input.off")("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");
         Writer("scene.json")(kScene + "}");
       },
       "run scene.json --mesh input.off --repair",
       {"another body", "the volume went from none to", "--repair-change"}},

      // --- Files of arrays
      {"ANpzThatInflates",
       python("with zipfile.ZipFile('input.npz', 'w', zipfile.ZIP_DEFLATED) as z, z.open('x.npy', 'w') as f:\n"
              "  f.write(np.lib.format.magic(1, 0) + struct.pack('<H', 118) + "
              "b\"{'descr': '<f8', 'fortran_order': False, 'shape': (39321600,), }\".ljust(118))\n"
              "  for k in range(300): f.write(bytes(1 << 20))\n"),
       "check input.npz",
       {"x.npy", "becomes more than"}},
      {"ManyArraysThatInflate",
       python("with zipfile.ZipFile('input.npz', 'w', zipfile.ZIP_DEFLATED) as z:\n"
              "  for n in range(30):\n"
              "    with z.open(f'x{n}.npy', 'w') as f:\n"
              "      for k in range(10): f.write(bytes(1 << 20))\n"),
       "check input.npz",
       {"becomes more than"}},
      {"AnNpzOfManyFiles",
       python("with zipfile.ZipFile('input.npz', 'w') as z:\n"
              "  for n in range(60000): z.writestr(f'{n}.npy', b'')\n"),
       "check input.npz",
       {"60000 arrays"}},
      {"AnNpzOfVeryManyFiles",  // 46 bytes of directory each, after the same file
       python("n = 500000\n"
              "entry = b'PK\\1\\2' + bytes(24) + struct.pack('<H', 5) + bytes(16)\n"
              "with open('input.npz', 'wb') as f:\n"
              "  f.write(b'PK\\3\\4' + bytes(26))\n"
              "  for k in range(n): f.write(entry + b'a.npy')\n"
              "  end = f.tell()\n"
              "  f.write(b'PK\\6\\6' + struct.pack('<QHHIIQQQQ', 44, 45, 45, 0, 0, n, n, end - 30, 30))\n"
              "  f.write(b'PK\\6\\7' + struct.pack('<IQI', 0, end, 1))\n"
              "  f.write(b'PK\\5\\6' + struct.pack('<HHHHIIH', 0, 0, 65535, 65535, 2**32 - 1, 2**32 - 1, 0))\n"),
       "check input.npz",
       {"500000 arrays"}},
      {"AnHdf5FileThatInflates",
       python("with h5py.File('input.h5', 'w') as f:\n"
              "  x = f.create_dataset('x', (39321600,), 'f8', chunks=(131072,), compression='gzip')\n"
              "  for k in range(300): x[k * 131072:(k + 1) * 131072] = 0\n"),
       "check input.h5",
       {"x", "more than"}},
      {"AnHdf5FileOfNothing",
       python("with h5py.File('input.h5', 'w') as f: f.create_dataset('x', (1 << 28,), 'f8', chunks=(1 << 16,))\n"),
       "check input.h5",
       {"x", "claims 2147483648 bytes", "0 are stored"}},
      {"AnHdf5LinkToAnotherFile",
       python("with h5py.File('input.h5', 'w') as f: f['x'] = h5py.ExternalLink('/etc/passwd', '/x')\n"),
       "check input.h5",
       {"x", "link"}},
      {"AnHdf5LinkToItself",
       python("with h5py.File('input.h5', 'w') as f: f['x'] = h5py.SoftLink('/x')\n"),
       "check input.h5",
       {"x", "link"}},
      {"AnHdf5FileWhoseNumbersLieElsewhere",
       python("with h5py.File('input.h5', 'w') as f:\n"
              "  f.create_dataset('x', (6,), 'f8', external=[('/etc/passwd', 0, 48)])\n"),
       "check input.h5",
       {"x", "other files"}},
      {"AVirtualDataset",
       python("with h5py.File('input.h5', 'w') as f:\n"
              "  v = h5py.VirtualLayout((6,), 'f8')\n  v[:] = h5py.VirtualSource('/etc/passwd', 'x', (6,))\n"
              "  f.create_virtual_dataset('x', v)\n"),
       "check input.h5",
       {"x", "virtual"}},
      {"AFilterOfSomebody",
       python("with h5py.File('input.h5', 'w') as f:\n"
              "  p = h5py.h5p.create(h5py.h5p.DATASET_CREATE)\n  p.set_chunk((6,))\n"
              "  p.set_filter(32015, h5py.h5z.FLAG_OPTIONAL)\n"
              "  d = h5py.h5d.create(f.id, b'x', h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((6,)), p)\n"
              "  d.write(h5py.h5s.ALL, h5py.h5s.ALL, np.zeros(6))\n"),
       "check input.h5",
       {"filter 32015"}},
      {"AnEscapeInTheNameOfAnArray",
       python("with h5py.File('input.h5', 'w') as f: f['\\x1b[31m/a'] = np.zeros(3)\n"),
       "check input.h5",
       {R"(\x1b[31m)"}},
      {"AnArrayWhoseNameIsNoUtf8",
       python("with h5py.File('input.h5', 'w') as f: f.create_group(b'caf\\xe9')\n"),
       "check input.h5",
       {R"(caf\xe9)"}},

      // --- Runs
      {"ARunOfNothing", [] { files::create_directory("run"); }, "check run", {"run", "no file of a run"}},
      {"AFolderThatIsNamedAsAFile",
       [] { files::create_directory("input.h5"); },
       "check input.h5",
       {"no file of a run"}},
      {"APipeInARun", folder_of_a_run("os.mkfifo('run/000000.npz')\n"), "check run", {"000000.npz", "a pipe"}},
      {"AFolderInARun", folder_of_a_run("os.mkdir('run/000000.npz')\n"), "check run", {"000000.npz", "a folder"}},
      {"ALinkToNothingInARun",
       folder_of_a_run("save(0)\nos.symlink('away', 'run/000001.npz')\n"),
       "check run",
       {"000001.npz", "no such file"}},
      {"ALinkToItselfInARun",
       folder_of_a_run("os.symlink('000000.npz', 'run/000000.npz')\n"),
       "check run",
       {"000000.npz", "cannot be opened"}},
      {"ATerabyteInARun",
       folder_of_a_run("open('run/000000.npz', 'w').truncate(1 << 40)\n"),
       "check run",
       {"000000.npz", "neither"}},
      {"ARunOfTwoSeries",
       folder_of_a_run("save(0)\nos.rename('run/000000.npz', 'run/a_000000.npz')\nsave(1)\n"),
       "check run",
       {"another series"}},
      {"ARunWithAGap", folder_of_a_run("for k in (0, 1, 3): save(k)\n"), "check run", {"000003", "equal steps"}},
      {"AnHdf5RunWithAGap",
       hdf5_of_a_run("for k in (0, 10, 20, 40): f[f'{k:06}/positions'] = x\n"),
       "check input.h5",
       {"000040", "equal steps"}},
      {"ASegmentThatInflates",
       hdf5_of_a_run("y = f.create_dataset('000000/vertices', (13107200, 3), 'f8', chunks=(43690, 3), "
                     "compression='gzip')\n"
                     "for k in range(300): y[k * 43690:(k + 1) * 43690] = 0\n"),
       "check input.h5",
       {"input.h5/000000", "vertices", "more than"}},
      {"ASegmentThatClaimsMuch",
       hdf5_of_a_run("f.create_dataset('000000/positions', (1, 1 << 27, 3), 'f8', chunks=(1, 1 << 16, 3))\n"),
       "check input.h5",
       {"input.h5/000000", "positions", "claims 3221225472 bytes"}},
      {"ManySegmentsThatAreOne",  // 160 MiB, twice
       hdf5_of_a_run("f['000000/positions'] = x\n"
                     "f['000000/groups_offsets'] = [0, 20971200]\n"
                     "f['000000'].create_dataset('groups_members', data=np.zeros(20971200, 'u1'), "
                     "compression='gzip')\n"
                     "for k in range(1, 1000): f[f'{k:06}'] = f['000000']\n"),
       "check input.h5",
       {"input.h5/000001", "become more than"}},
      {"GroupsOfAHundredMillion",
       hdf5_of_a_run("f['000000/positions'] = x\n"
                     "f.create_dataset('000000/groups_offsets', data=[0, 10**8])\n"
                     "f.create_dataset('000000/groups_members', data=np.zeros(10**8, 'u1'), compression='gzip')\n"),
       "check input.h5",
       {"groups_members", "becomes more than"}},
      {"AHundredMillionGroups",
       hdf5_of_a_run("f['000000/positions'] = x\n"
                     "f.create_dataset('000000/groups_offsets', data=np.zeros(10**8, 'u1'), compression='gzip')\n"),
       "check input.h5",
       {"groups_offsets", "becomes more than"}},
      {"ASegmentInAnotherFile",
       hdf5_of_a_run("f['000000'] = h5py.ExternalLink('/etc/passwd', '/')\n"),
       "check input.h5",
       {"000000", "link"}},
      {"ASegmentThatIsALinkToItself",
       hdf5_of_a_run("f['000000'] = h5py.SoftLink('/000000')\n"),
       "check input.h5",
       {"000000", "link"}},
      {"ASegmentWithinItself",
       hdf5_of_a_run("f['000000/positions'] = x\nf['000000/rest'] = f['000000']\n"),
       "check input.h5",
       {"input.h5/000000", "rest", "no dataset"}},
      {"PositionsInAnotherFile",
       hdf5_of_a_run("f['000000/positions'] = x\nf['000001/positions'] = h5py.ExternalLink('/etc/passwd', '/')\n"),
       "check input.h5",
       {"input.h5/000001", "positions", "link"}},
      {"ASegmentThatIsADataset", hdf5_of_a_run("f['000000'] = x\n"), "check input.h5", {"000000", "group"}},
      {"ATypeThatIsNoneInARun",
       hdf5_of_a_run("f['000000/positions'] = x\nf['000000/alive'] = np.zeros((1, 2), 'c16')\n"),
       "check input.h5",
       {"input.h5/000000", "alive", "neither numbers nor text"}},
      {"PositionsWithoutAxes",
       folder_of_a_run("save(0, positions=[])\n"),
       "check run",
       {"positions", "should be (any, any, 3)"}},
      {"CellsWithoutAxes",
       folder_of_a_run("save(0, cells=np.zeros(0, int))\n"),
       "check run",
       {"cells", "should be (any, any)"}},
      {"OffsetsOfNoGroups",
       folder_of_a_run("save(0, groups_offsets=[], groups_members=[])\n"),
       "check run",
       {"groups_offsets", "is empty"}},
      {"ManyPatchesOfABlade",
       folder_of_a_run("save(0, blade=np.zeros((1, 10001, 3, 3)))\n"),
       "check run",
       {"blade", "10001 patches", "10000"}},
      {"AFlagThatIsNone",
       folder_of_a_run("save(0, alive=np.full((1, 2), 2**40))\n"),
       "check run",
       {"alive", "1099511627776"}},
      {"AMassThatIsNoNumber", folder_of_a_run("save(0, mass=[np.inf, 1])\n"), "check run", {"mass", "It holds inf"}},
      {"GravityThatIsNoNumber", folder_of_a_run("save(0, gravity=[0, 0, np.nan])\n"), "check run", {"gravity"}},
      {"ASpacingWithoutEnd", folder_of_a_run("save(0, spacing=np.inf)\n"), "check run", {"spacing", "It is inf"}},
      {"ARoundoffThatForgivesAll",
       folder_of_a_run("save(0, unit_roundoff=1.0)\n"),
       "check run",
       {"unit_roundoff", "too few digits"}},
      {"APromiseInALaterSegment",
       folder_of_a_run("save(0)\nsave(1, promises='free')\n"),
       "check run",
       {"000001.npz", "promises", "once"}},
      {"APromiseOfManyBytes",
       folder_of_a_run("save(0, promises='free ' * 10000)\n"),
       "check run",
       {"promises", "50000 bytes"}},
      {"AnEscapeInAPromise",
       folder_of_a_run("save(0, promises='\\x1b[31m')\n"),
       "check run",
       {"promises", R"(\x1b[31m)"}},

      // --- Recordings
      {"ARecordingThatInflates",
       changed_recording("del f['setup/body/mass']\n"
                         "x = f.create_dataset('setup/body/mass', (39321600,), 'f8', chunks=(131072,), "
                         "maxshape=(None,), compression='gzip')\n"
                         "for k in range(300): x[k * 131072:(k + 1) * 131072] = 1\n"),
       "check input",
       {"setup/body/mass", "become more than"}},
      {"ARecordingThatClaimsMuch",
       changed_recording("f['setup/body/mass'].resize((1 << 40,))\n"),
       "check input",
       {"setup/body/mass", "claims 1099511627776 rows"}},
      {"ARecordingWithALinkToAnotherFile",
       changed_recording("del f['setup/body/mass']\nf['setup/body/mass'] = h5py.ExternalLink('/etc/passwd', '/x')\n"),
       "check input",
       {"setup/body/mass", "link"}},
      {"ARecordingWithALinkToItself",
       changed_recording("del f['setup']\nf['setup'] = h5py.SoftLink('/setup')\n"),
       "check input",
       {"setup", "link"}},
      {"ARecordingWithAGroupElsewhere",
       changed_recording("del f['snapshots']\nf['snapshots'] = h5py.ExternalLink('/etc/passwd', '/')\n"),
       "digest input",
       {"snapshots", "link"}},
      {"ARecordingWhoseNumbersLieElsewhere",
       changed_recording("n = f['setup/body/mass'].shape\ndel f['setup/body/mass']\n"
                         "f.create_dataset('setup/body/mass', n, 'f8', external=[('/dev/zero', 0, 8 * n[0])])\n"),
       "check input",
       {"setup/body/mass", "other files"}},
      {"ARecordingOfVirtualDatasets",
       changed_recording("n = f['setup/body/mass'].shape\ndel f['setup/body/mass']\n"
                         "v = h5py.VirtualLayout(n, 'f8')\nv[:] = h5py.VirtualSource('/etc/passwd', 'x', n)\n"
                         "f.create_virtual_dataset('setup/body/mass', v)\n"),
       "check input",
       {"setup/body/mass", "virtual"}},
      {"ARecordingThroughAFilterOfSomebody",
       changed_recording("n = f['setup/body/mass'].shape\ndel f['setup/body/mass']\n"
                         "p = h5py.h5p.create(h5py.h5p.DATASET_CREATE)\np.set_chunk((6,))\n"
                         "p.set_filter(32015, h5py.h5z.FLAG_OPTIONAL)\n"
                         "h5py.h5d.create(f['setup/body'].id, b'mass', h5py.h5t.IEEE_F64LE, "
                         "h5py.h5s.create_simple(n), p)\n"),
       "check input",
       {"setup/body/mass", "filter 32015"}},
      {"ARecordingWhoseSceneIsNested",
       changed_recording("del f['scene']\nf.create_dataset('scene', data=np.full(300000, ord('['), 'u1'))\n"),
       "check input",
       {"its scene", "nested too deeply"}},
  };
  return all;
}

struct Measured : Outcome {
  long memory = 0;  // [KiB] resident, at most
  double processor_seconds = 0;
};

Measured run(const std::string& arguments) {
  int ends[2];
  if (pipe(ends) != 0) throw std::runtime_error("pipe");
  const std::string command = "exec '" CUTPROOF_PROGRAM "' " + arguments;
  const pid_t child = fork();
  if (child == 0) {
    // Standard input is a pipe that nobody writes to: who reads it, hangs.
    int unwritten[2];
    if (pipe(unwritten) != 0 || dup2(unwritten[0], 0) < 0 || dup2(ends[1], 1) < 0 || dup2(ends[1], 2) < 0) _exit(126);
    close(ends[0]);
    alarm(kMostSeconds);
    execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
    _exit(127);
  }
  close(ends[1]);
  Measured outcome;
  std::array<char, 4096> block;
  for (ssize_t n; (n = read(ends[0], block.data(), block.size())) > 0;) {
    outcome.output.append(block.data(), static_cast<std::size_t>(n));
  }
  close(ends[0]);
  int status = 0;
  rusage usage = {};
  if (child < 0 || wait4(child, &status, 0, &usage) != child) throw std::runtime_error("wait4");
  outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.memory = usage.ru_maxrss;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  outcome.processor_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  return outcome;
}

bool with_sanitizers() { return std::string_view(CUTPROOF_SANITIZERS) != ""; }

// [KiB]. Beside what the program takes to say its version, what little may inflate to before it is refused
// (model/io/limits.h). Nothing else takes more before it is known to be too much: two million faces of an OBJ are 8
// bytes of text each, 24 of a list, half as many again while lists move, and 32 of a block with three corners, 160 MiB.
long most_memory() {
  static const long itself = run("--version").memory;
  return itself + static_cast<long>(io::kFreeInflation >> 10);
}

// Runs in its folder, as the program does.
class InItsFolder : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    before_ = files::current_path();
    files::current_path(folder_);
  }
  void TearDown() override {
    files::current_path(before_);
    Program::TearDown();
  }

 private:
  files::path before_;
};

class HostileInput : public InItsFolder, public testing::WithParamInterface<Hostile> {};

TEST_P(HostileInput, IsRefusedWithARemedy) {
  GetParam().make();
  const std::set<std::string> before = listing();
  const Measured outcome = run(GetParam().arguments);
  const std::string shown = shortened(outcome.output, 2000);
  EXPECT_EQ(outcome.status, 2) << shown;
  for (const std::string& word : GetParam().words) {
    EXPECT_NE(outcome.output.find(word), std::string::npos) << "no '" << word << "' in:\n" << shown;
  }
  EXPECT_EQ(outcome.output, printable_lines(outcome.output));
  EXPECT_LT(outcome.output.size(), 10'000u);
  EXPECT_TRUE(outcome.output.starts_with("cutproof: ")) << shown;
  EXPECT_NE(outcome.output.find("\n  remedy: "), std::string::npos) << shown;
  if (!with_sanitizers()) {
    EXPECT_LT(outcome.memory, most_memory()) << shown;
  }
  EXPECT_EQ(listing(), before) << "something was written";
  // Told, not asserted: under 2 s is what is wanted.
  std::cout << GetParam().name << ": " << outcome.processor_seconds << " s of a processor\n";
}

INSTANTIATE_TEST_SUITE_P(Table, HostileInput, testing::ValuesIn(hostile_inputs()),
                         [](const auto& row) { return std::string(row.param.name); });

// --- Names that are no UTF-8, or would act on a terminal, where everything else is as it should be

class HostileName : public InItsFolder, public testing::WithParamInterface<std::string> {};

std::string in_quotes(const std::string& name) { return "'" + name + "'"; }

TEST_P(HostileName, WorksForWhatIsReadAndWritten) {
  const std::string name = GetParam();
  files::create_directory(name);
  const std::string in = name + "/" + name;
  Writer(in + ".json")(kScene + R"(, "name": "\u001b[31ma\u009b\u202e\n:", "description": "one\nall is well"})");
  const auto expect = [&](const std::string& arguments, int status) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.status, status) << arguments << "\n" << outcome.output;
    EXPECT_EQ(outcome.output, printable_lines(outcome.output)) << arguments;
    EXPECT_EQ(outcome.output.find("\nall is well"), std::string::npos) << outcome.output;
    return outcome.output;
  };
  const auto expect_json = [&](const std::string& file) {
    const std::string written = read(file);
    EXPECT_TRUE(nlohmann::json::accept(written)) << file << ": " << shortened(written, 1000);
    EXPECT_EQ(written, printable_lines(written)) << file;
    return nlohmann::json::parse(written, nullptr, false);
  };
  const std::string ran = expect("run " + in_quotes(in + ".json") + " --check --json " + in_quotes(in + ".run.json") +
                                     " --junit " + in_quotes(in + ".xml") + " --record " + in_quotes(in),
                                 0);
  EXPECT_NE(ran.find(printable(in)), std::string::npos) << ran;
  expect_json(in + ".run.json");
  const std::string junit = read(in + ".xml");
  EXPECT_EQ(junit, printable_lines(junit));
  EXPECT_NE(junit.find("testcase"), std::string::npos);

  const std::string checked = expect("check " + in_quotes(in) + " --json " + in_quotes(in + ".check.json"), 0);
  EXPECT_NE(checked.find(printable(in)), std::string::npos) << checked;
  EXPECT_EQ(expect_json(in + ".check.json").at("source"), is_utf8(in) ? in : printable(in));
  expect("digest " + in_quotes(in), 0);

  expect("fuzz --backend reference --cases 3 --sizes 0-3 --save " + in_quotes(name) + " --json " +
             in_quotes(in + ".fuzz.json"),
         0);
  expect_json(in + ".fuzz.json");
  expect("fuzz --merge " + in_quotes(in + ".fuzz.json") + " --json " + in_quotes(in + ".merged.json"), 0);
  expect_json(in + ".merged.json");

  files::copy_file(CUTPROOF_SOURCE "/fixtures/regressions/pair_on_a_wall.json", in + ".case.json");
  expect("replay --backend reference " + in_quotes(in + ".case.json") + " --record " + in_quotes(in + ".replayed"), 0);
  expect("digest " + in_quotes(in + ".replayed"), 0);

  // A cube as a mesh; the body takes the file's name.
  Writer(in + ".off")("OFF 8 6 12\n0 0 0\n9 0 0\n9 9 0\n0 9 0\n0 0 9\n9 0 9\n9 9 9\n0 9 9\n")(
      "4 3 2 1 0\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  Writer("scene.json")(R"({"version": 5, "frame": {"count": 1}, "body": {"particles": 64, "shape": {"kind": "box"}}})");
  expect("run scene.json --mesh " + in_quotes(in + ".off") + " --record " + in_quotes(in + ".meshed") + " --json " +
             in_quotes(in + ".mesh.json"),
         0);
  EXPECT_EQ(expect_json(in + ".mesh.json").at("body").at("name"), printable(name + ".off"));
  expect("check " + in_quotes(in + ".meshed"), 0);

  expect("vectors split -o " + in_quotes(in + ".npz"), 0);
  expect("check " + in_quotes(in + ".npz"), 2);  // no state
  expect("tune " + in_quotes(in + ".json") +
             " --tolerance 100 --frames 1 --backend host --reference substeps --write " +
             in_quotes(in + ".tuned.json") + " --json " + in_quotes(in + ".tune.json"),
         0);
  expect_json(in + ".tune.json");
}

std::string label_of(const testing::TestParamInfo<std::string>& name) {
  constexpr std::array kLabels = {"NoUtf8", "Escapes", "DirectionAndC1", "Plain"};
  return kLabels[name.index];
}
INSTANTIATE_TEST_SUITE_P(Names, HostileName,
                         testing::Values("caf\xe9", "\x1b[31mred\x1b[0m", "\xe2\x80\xaenames\xc2\x9b", "plain"),
                         label_of);

// The command that shows a failure again is one that a shell takes.
class ACommandToBeGivenAgain : public InItsFolder {};

TEST_F(ACommandToBeGivenAgain, IsOneForSuchNamesToo) {
  const std::string name = "caf\xe9 it's \x1b[1m";
  Writer{name}(kScene + R"(, "expect": {"particles": 1}})");
  setenv("GITHUB_ACTIONS", "true", 1);
  const Outcome outcome = run("run \"" + name + "\" --check");
  unsetenv("GITHUB_ACTIONS");
  EXPECT_EQ(outcome.status, 1) << outcome.output;
  EXPECT_EQ(outcome.output, printable_lines(outcome.output));
  EXPECT_NE(outcome.output.find(R"($'caf\xe9 it\'s \x1b[1m')"), std::string::npos) << outcome.output;
  Writer("again.sh")(R"(exec ')" CUTPROOF_PROGRAM R"(' run $'caf\xe9 it\'s \x1b[1m' --check > again.txt)");
  EXPECT_EQ(WEXITSTATUS(std::system("bash again.sh")), 1);
  EXPECT_NE(read("again.txt").find("particles"), std::string::npos);
}

}  // namespace
}  // namespace cutproof::tests::hostile_inputs_test
