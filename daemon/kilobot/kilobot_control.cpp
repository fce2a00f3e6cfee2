#include "daemon/kilobot/kilobot_control.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "daemon/kilobot/kilobot_commands.hpp"

namespace swarmtalk::daemon {
namespace {

using namespace kilobot_bridge;

std::uint64_t to_ms(Duration time) {
  return static_cast<std::uint64_t>(
      std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

ipc::KilobotEnd end_of(SequenceEnd end) {
  if (end == SequenceEnd::kFailed) return ipc::KILOBOT_FAILED;
  return end == SequenceEnd::kStopped ? ipc::KILOBOT_STOPPED : ipc::KILOBOT_SENT;
}

}  // namespace

/// One link and the command that it is sending.
class KilobotControl::LinkCommands final : public SequenceUser {
 public:
  LinkCommands(std::string link_name, KilobotLink& link)
      : name(std::move(link_name)), link_(link) {}

  std::optional<Refusal> begin(KilobotPlan plan, KilobotClient& client, std::uint32_t id,
                               ipc::KilobotStarted& started) {
    const Player preview(plan.sequence, link_.pacing());
    const std::string what = plan.sequence.name;
    const std::string problem = link_.begin(std::move(plan.sequence), *this);
    if (!problem.empty()) {
      const bool is_busy = link_.player() != nullptr;
      return Refusal{is_busy ? ipc::ERROR_BUSY : ipc::ERROR_LINK_DOWN, problem, std::nullopt};
    }
    client_ = &client;
    id_ = id;
    started.set_duration_ms(to_ms(link_.pacing().to_ours(preview.left())));
    started.set_frames(preview.frames());
    spdlog::info("link {}: '{}' to the Kilobots begins", name, what);
    return std::nullopt;
  }

  /// STOP while a command is being sent ends that one; both clients are told.
  bool stop_for(KilobotClient& client, std::uint32_t id) {
    if (link_.player() == nullptr) return false;
    stoppers_.emplace_back(&client, id);
    link_.stop();
    return true;
  }

  bool cancel(std::uint32_t id, const KilobotClient& client) {
    if (client_ != &client || id_ != id || link_.player() == nullptr) return false;
    is_cancelled_ = true;
    link_.stop();
    return true;
  }

  void forget(const KilobotClient& client) {
    std::erase_if(stoppers_, [&](const auto& stopper) { return stopper.first == &client; });
    if (client_ != &client) return;
    client_ = nullptr;
    link_.stop();
  }

  bool has_single() const { return link_.has_single(); }

  void on_sequence_frame(const Player& player) override {
    if (client_ == nullptr) return;
    ipc::KilobotProgress progress;
    progress.set_operation_id(id_);
    progress.set_frames_sent(player.frames_sent());
    progress.set_left_ms(to_ms(link_.pacing().to_ours(player.left())));
    const Sequence& sequence = player.sequence();
    if (!sequence.repeated.empty() && player.pass() > 0) {
      progress.set_pass(player.pass());
      progress.set_page(player.index());
    }
    const bool shows_bit =
        sequence.name == "read-uid" && player.frames_sent() <= sequence.before.size();
    if (shows_bit) progress.set_bit(sequence.before[player.index()].frame[kOverheadPayload]);
    client_->on_kilobot_progress(progress);
  }

  void on_sequence_end(const Player& player, SequenceEnd end, const std::string& text) override {
    ipc::KilobotEnded ended;
    ended.set_operation_id(id_);
    ended.set_end(end_of(end));
    ended.set_text(end == SequenceEnd::kStopped && !is_cancelled_ && client_ != nullptr
                       ? "another program sent STOP"
                       : text);
    ended.set_passes_sent(player.passes_sent());
    spdlog::info("link {}: '{}' to the Kilobots {}", name, player.sequence().name,
                 end == SequenceEnd::kSent ? "was sent" : "ended early: " + text);
    KilobotClient* client = std::exchange(client_, nullptr);
    is_cancelled_ = false;
    if (client != nullptr) client->on_kilobot_ended(ended);
    ended.set_end(end == SequenceEnd::kFailed ? ipc::KILOBOT_FAILED : ipc::KILOBOT_SENT);
    for (const auto& [stopper, id] : std::exchange(stoppers_, {})) {
      ended.set_operation_id(id);
      stopper->on_kilobot_ended(ended);
    }
  }

  const std::string name;

 private:
  KilobotLink& link_;
  KilobotClient* client_ = nullptr;
  std::uint32_t id_ = 0;
  bool is_cancelled_ = false;  // by its own client
  std::vector<std::pair<KilobotClient*, std::uint32_t>> stoppers_;
};

KilobotControl::KilobotControl() = default;
KilobotControl::~KilobotControl() = default;

void KilobotControl::add(const std::string& name, KilobotLink& link) {
  links_.push_back(std::make_unique<LinkCommands>(name, link));
}

std::optional<Refusal> KilobotControl::find(const ipc::KilobotCommand& command,
                                            LinkCommands*& found) const {
  std::string names;
  for (const auto& link : links_) {
    names += (names.empty() ? "" : ", ") + link->name;
    if (command.has_link() ? link->name == command.link() : links_.size() == 1) found = link.get();
  }
  if (found != nullptr) return std::nullopt;
  std::string text = "this daemon has no link of type kilobot; add one to its configuration";
  if (!links_.empty()) {
    text = command.has_link()
               ? "there is no kilobot link '" + command.link() + "', only " + names
               : "there are several kilobot links: " + names + "; name one with --link";
  }
  return Refusal{ipc::ERROR_BAD_COMMAND, std::move(text), std::nullopt};
}

std::optional<Refusal> KilobotControl::begin(const ipc::KilobotCommand& command,
                                             KilobotClient& client, ipc::KilobotStarted& started) {
  LinkCommands* link = nullptr;
  if (auto refusal = find(command, link)) return refusal;
  KilobotPlan plan;
  if (auto refusal = plan_kilobot_command(command, link->has_single(), plan)) return refusal;
  const std::uint32_t id = ++last_operation_id_;
  started.set_operation_id(id);
  started.set_link(link->name);
  started.set_pages(plan.pages);
  for (const std::string& warning : plan.warnings) started.add_warnings(warning);
  if (command.action() == ipc::KILOBOT_STOP && link->stop_for(client, id)) return std::nullopt;
  return link->begin(std::move(plan), client, id, started);
}

std::optional<Refusal> KilobotControl::cancel(std::uint32_t operation_id,
                                              const KilobotClient& client) {
  for (const auto& link : links_) {
    if (link->cancel(operation_id, client)) return std::nullopt;
  }
  return Refusal{
      ipc::ERROR_UNKNOWN_ID,
      "this connection has no command " + std::to_string(operation_id) + " that is being sent",
      std::nullopt};
}

void KilobotControl::forget(const KilobotClient& client) {
  for (const auto& link : links_) link->forget(client);
}

}  // namespace swarmtalk::daemon
