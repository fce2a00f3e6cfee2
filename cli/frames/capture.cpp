#include <pcap/pcap.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>

#include "cli/common/commands.hpp"
#include "cli/common/deadline.hpp"
#include "cli/common/link_watch.hpp"
#include "cli/common/operator.hpp"
#include "cli/frames/capture_files.hpp"
#include "cli/frames/unseal.hpp"
#include "text/counted.hpp"
#include "text/plain.hpp"

namespace swarmtalk::cli {
namespace {

constexpr int kSnapBytes = 65535;
constexpr std::size_t kNodeAt = 8;  // in an air frame, docs/wire-format.md
constexpr std::chrono::seconds kFlushPeriod(1);
constexpr std::uint64_t kNsPerS = 1'000'000'000;

/// The capture and, beside a file, a list of what was dropped.
class CaptureFiles {
 public:
  explicit CaptureFiles(Unsealer& unseal) : unseal_(unseal) {}

  /// @return empty, or what went wrong
  std::string open(const std::string& path, bool replaces) {
    format_.reset(
        pcap_open_dead_with_tstamp_precision(DLT_EN10MB, kSnapBytes, PCAP_TSTAMP_PRECISION_NANO));
    if (std::string problem = capture_.open(path, replaces, format_.get()); !problem.empty()) {
      return problem;
    }
    if (std::string problem = capture_.take_place(); !problem.empty()) return problem;
    if (capture_.is_stream()) return {};
    list_ = path + ".dropped";
    dropped_.reset(std::fopen(list_.c_str(), "we"));
    if (!dropped_) return "cannot write " + list_ + ": " + std::strerror(errno);
    std::fprintf(dropped_.get(), "frame\ttime\tlink\tcause\tcount\n");
    return {};
  }

  void write(const ipc::Captured& captured) {
    ++frames_;
    if (captured.missed() > 0) note(captured, "not_captured", captured.missed());
    for (const ipc::Counter& cause : captured.dropped()) {
      note(captured, cause.name(), cause.value());
    }
    const std::string frame = unseal_(captured.frame());
    std::string bytes = captured.ethernet_header();
    if (bytes.size() != kEthernetHeaderBytes) bytes = made_up_header(frame);
    bytes += frame;
    pcap_pkthdr header{};
    header.ts.tv_sec = static_cast<time_t>(captured.time_ns() / kNsPerS);
    header.ts.tv_usec = static_cast<suseconds_t>(captured.time_ns() % kNsPerS);  // nanoseconds
    header.caplen = header.len = static_cast<bpf_u_int32>(bytes.size());
    capture_.write(header, bytes);
  }

  /// @return empty, or what went wrong, now or before
  std::string flush() {
    if (std::string problem = capture_.flush(); !problem.empty()) return problem;
    if (!dropped_) return {};
    if (std::fflush(dropped_.get()) == 0 && std::ferror(dropped_.get()) == 0) return {};
    return "cannot write " + list_ + ": " + std::strerror(errno);
  }

  std::uint64_t frames() const { return frames_; }
  std::string told_drops() const {
    if (!dropped_) return text::counted(drops_, "drop") + ", not listed";
    return list_ + ": " + text::counted(lines_, "line");
  }

 private:
  /// Broadcast, from a local address with the node id in it, EtherType 0x88B5.
  static std::string made_up_header(const std::string& frame) {
    std::string header(6, '\xFF');
    header.append("\x02ST\0", 4);
    header += frame.size() > kNodeAt + 1 ? frame.substr(kNodeAt, 2) : std::string(2, '\0');
    return header + "\x88\xB5";
  }

  void note(const ipc::Captured& captured, const std::string& cause, std::uint64_t count) {
    drops_ += count;
    if (!dropped_) return;
    ++lines_;
    const auto seconds = static_cast<std::time_t>(captured.time_ns() / kNsPerS);
    std::tm utc{};
    gmtime_r(&seconds, &utc);
    std::array<char, 32> time{};
    std::strftime(time.data(), time.size(), "%Y-%m-%dT%H:%M:%S", &utc);
    std::fprintf(dropped_.get(), "%llu\t%s.%09lluZ\t%s\t%s\t%llu\n",
                 static_cast<unsigned long long>(frames_), time.data(),
                 static_cast<unsigned long long>(captured.time_ns() % kNsPerS),
                 text::plain(captured.link()).c_str(), text::plain(cause).c_str(),
                 static_cast<unsigned long long>(count));
  }

  Unsealer& unseal_;
  std::unique_ptr<pcap_t, FileCloser> format_;
  CaptureWriter capture_;
  std::string list_;
  std::unique_ptr<std::FILE, FileCloser> dropped_;
  std::uint64_t frames_ = 0;
  std::uint64_t lines_ = 0;
  std::uint64_t drops_ = 0;  // as the counters have them
};

/// Once, at the start: the frames that come are the end of the silence.
void tell_dead_links(const Common& common) {
  Client client = make_client(common);
  if (client.connect()) LinkWatch(client).look();
}

}  // namespace

int capture(const Common& common, const CaptureArguments& arguments) {
  Unsealer unseal;
  if (const std::string problem = unseal.load(arguments.key_file); !problem.empty()) {
    return fail(problem);
  }
  std::signal(SIGXFSZ, SIG_IGN);  // a limit on a file's size is told as a full disk is
  if (!arguments.from.empty()) return copy_capture(arguments, unseal);
  OperatorConnection daemon;
  if (const Status status = daemon.open(common.socket_path); !status) return fail(status);
  CaptureFiles files(unseal);
  if (const std::string problem = files.open(arguments.file, arguments.replaces);
      !problem.empty()) {
    return fail(problem);
  }
  interrupt_on_signals();
  tell_what_ends_a_job();
  ipc::Envelope envelope;
  ipc::Envelope answer;
  envelope.mutable_capture();
  if (const Status status = daemon.request(envelope, answer); !status) return fail(status);
  tell_dead_links(common);
  const bool has_end = arguments.timeout_s > 0;
  const auto end = after(Clock::now(), seconds(has_end ? arguments.timeout_s : 1e12));
  int exit_code = kExitOk;
  std::string problem;
  auto next_flush = Clock::now();
  while (problem.empty() && caught_signal() == 0 &&
         (arguments.count == 0 || files.frames() < arguments.count)) {
    envelope.Clear();
    if (Clock::now() >= next_flush) {
      problem = files.flush();
      next_flush = Clock::now() + kFlushPeriod;
    }
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(std::min(end, next_flush) - Clock::now());
    const Status status = daemon.next(envelope, left);
    if (status.code() == StatusCode::kTimeout) {
      if (!has_end || Clock::now() < end) continue;
      if (arguments.count > 0) exit_code = kExitTimeout;
      break;
    }
    if (!status) {
      exit_code = fail(status);
      break;
    }
    if (!envelope.has_captured()) continue;
    files.write(envelope.captured());
  }
  if (problem.empty()) problem = files.flush();
  if (!problem.empty()) return fail(problem + "; what was written is readable up to there");
  const int printed = unseal.tell(
      arguments.file, text::counted(files.frames(), "frame") + "; " + files.told_drops());
  if (exit_code == kExitOk && caught_signal() != 0) exit_code = kExitSignal + caught_signal();
  return exit_code != kExitOk ? exit_code : printed;
}

}  // namespace swarmtalk::cli
