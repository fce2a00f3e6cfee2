#include "tests/avr/emulated_node.hpp"

#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

#include "swarmtalk/profiles/kilobot.hpp"
#include "swarmtalk/swarmtalk.hpp"

namespace swarmtalk::avr {
namespace {

using Profile = core::Kilobot;
using W = core::Wire<Profile>;
using Counters = core::Counters<Profile>;
static_assert(sizeof(Counters) <= 32, "a bit for each counter");
static_assert(sizeof(Profile::Counter) == 1, "the image's counters are read byte by byte");
static_assert(W::kMtuBytes == 9, "mailbox.hpp has room for 9");

constexpr uint64_t kLongestCall = 1'000'000;  // cycles; far beyond any limit: it hangs
constexpr int16_t kNear = 50;
constexpr int16_t kFar = 200;

/// A program that goes astray may use any 16-bit address, and simavr lets it.
uint8_t* widened(uint8_t* memory, size_t size_bytes) {
  constexpr size_t kAddressSpaceBytes = 65536 + 4;
  auto* const wide = static_cast<uint8_t*>(std::realloc(memory, kAddressSpaceBytes));
  if (wide == nullptr) throw std::bad_alloc();
  std::fill(wide + size_bytes, wide + kAddressSpaceBytes, uint8_t{0});
  return wide;
}

}  // namespace

EmulatedNode::EmulatedNode(const std::string& image) : avr_(nullptr) {
  avr_global_logger_set(&on_complaint);
  elf_firmware_t firmware = {};
  if (elf_read_firmware(image.c_str(), &firmware) != 0) {
    throw std::runtime_error("cannot read " + image);
  }
  avr_ = avr_make_mcu_by_name("atmega328p");
  if (avr_ == nullptr) throw std::runtime_error("libsimavr knows no atmega328p");
  avr_init(avr_);
  avr_->frequency = 8'000'000;
  avr_->data = widened(avr_->data, avr_->ramend + 1u);
  avr_->log = LOG_ERROR;
  avr_->custom.data = this;
  avr_load_firmware(avr_, &firmware);
  skip_repair_.scan(avr_);
  avr_register_io_write(avr_, kBracketRegister, &on_bracket, this);
  avr_register_io_write(avr_, kReadyRegister, &on_ready, this);
  avr_register_io_write(avr_, kMailboxAddressRegister, &on_address, this);
  run_until_ready();
  fresh_ = save();
}

/// Of simavr: of an instruction that it cannot execute, or a program gone astray.
void EmulatedNode::on_complaint(avr_t* avr, int level, const char*, va_list) {
  if (avr == nullptr || avr->custom.data == nullptr) return;
  auto& node = *static_cast<EmulatedNode*>(avr->custom.data);
  if (!node.skip_repair_.execute(avr) && level == LOG_ERROR) node.is_astray_ = true;
}

EmulatedNode::~EmulatedNode() {
  if (avr_ != nullptr) avr_terminate(avr_);
}

void EmulatedNode::on_bracket(avr_t* avr, avr_io_addr_t, uint8_t value, void* param) {
  auto& node = *static_cast<EmulatedNode*>(param);
  node.is_measuring_ = value != 0;
  if (node.is_measuring_) {
    node.began_ = avr->cycle;
  } else {
    node.took_ = avr->cycle - node.began_;
  }
}
void EmulatedNode::on_ready(avr_t* avr, avr_io_addr_t, uint8_t, void* param) {
  static_cast<EmulatedNode*>(param)->is_ready_ = true;
  avr->state = cpu_Stopped;  // leaves avr_run()
}
void EmulatedNode::on_address(avr_t*, avr_io_addr_t, uint8_t value, void* param) {
  auto& node = *static_cast<EmulatedNode*>(param);
  node.mailbox_at_ = static_cast<uint16_t>(node.mailbox_at_ >> 8 | value << 8);
}

void EmulatedNode::run_until_ready() {
  is_ready_ = false;
  avr_->state = cpu_Running;
  const uint64_t from = avr_->cycle;
  while (!is_ready_) {
    if (on_instruction_) {
      run_watched();
    } else {
      avr_run(avr_);
    }
    if (is_astray_) throw std::runtime_error("the program used an address that is not there");
    if (is_ready_) break;
    if (avr_->state != cpu_Running || avr_->cycle - from > kLongestCall) {
      throw std::runtime_error("the program ended or hangs");
    }
  }
}

void EmulatedNode::run_watched() {
  const uint32_t pc = avr_->pc;
  const uint64_t cycle = avr_->cycle;
  const bool was_measuring = is_measuring_;
  avr_->run_cycle_count = 1;
  avr_run(avr_);
  if (was_measuring) on_instruction_(pc, static_cast<uint32_t>(avr_->cycle - cycle));
}

Mailbox EmulatedNode::mailbox() const {
  Mailbox mailbox;
  std::memcpy(&mailbox, avr_->data + mailbox_at_, sizeof mailbox);
  return mailbox;
}
void EmulatedNode::write(const Mailbox& mailbox) {
  std::memcpy(avr_->data + mailbox_at_, &mailbox, sizeof mailbox);
}

void EmulatedNode::give(Command command) {
  Mailbox box = mailbox();
  box.command = command;
  write(box);
  run_until_ready();
}

void EmulatedNode::start(const Start& start) {
  restore(fresh_);
  Mailbox box = mailbox();
  box.fixed_id = start.fixed_id;
  box.random = start.random;
  box.ticks = 100;
  std::copy_n(start.channels, 2, box.channels);
  write(box);
  give(Command::kStart);
}

EmulatedNode::State EmulatedNode::save() const {
  State state;
  state.memory.assign(avr_->data, avr_->data + avr_->ramend + 1);
  std::copy_n(avr_->sreg, 8, state.sreg.begin());
  state.pc = avr_->pc;
  state.pulled = pulled_;
  state.pulls = pulls_;
  return state;
}
void EmulatedNode::restore(const State& state) {
  std::copy(state.memory.begin(), state.memory.end(), avr_->data);
  std::copy(state.sreg.begin(), state.sreg.end(), avr_->sreg);
  avr_->pc = state.pc;
  pulled_ = state.pulled;
  pulls_ = state.pulls;
}

void EmulatedNode::measure(Command what, const OnCall& on_call) {
  uint8_t before[sizeof(Counters)];
  const uint8_t* const counters = avr_->data + mailbox().counters;
  std::memcpy(before, counters, sizeof before);
  took_ = 0;
  give(what);
  Call call = {what == Command::kPull, static_cast<uint32_t>(took_), 0};
  for (size_t i = 0; i < sizeof before; ++i) {
    if (before[i] != counters[i]) call.counted |= UINT32_C(1) << i;
  }
  on_call(call);
}

void EmulatedNode::hear(const Packet& packet, int16_t distance, const OnCall& on_call) {
  Mailbox box = mailbox();
  std::copy(packet.begin(), packet.end(), box.packet);
  box.distance = distance;
  write(box);
  measure(Command::kHear, on_call);
}

void EmulatedNode::pull(uint32_t ticks, const OnCall& on_call) {
  wait(ticks);
  measure(Command::kPull, on_call);
  const Mailbox box = mailbox();
  if (box.result == 0) return;
  std::copy_n(box.packet, W::kMtuBytes, pulled_[pulls_ % pulled_.size()].begin());
  ++pulls_;
}

void EmulatedNode::send(const Step& step) {
  Mailbox box = mailbox();
  box.channel = step.channel;
  box.size = step.count;
  box.ttl = step.ttl;
  box.message[0] = 7;
  box.message[1] = 7;
  write(box);
  give(Command::kSend);
}

void EmulatedNode::wait(uint32_t ticks) {
  Mailbox box = mailbox();
  box.ticks += ticks;
  write(box);
}

EmulatedNode::Packet EmulatedNode::packet_of(const Step& step) const {
  W::Header header = {};
  header.node = (step.flags & Step::kOwn) != 0 ? mailbox().own_id : step.from;
  header.message = step.message;
  header.sequence = step.sequence;
  header.end = (step.flags & Step::kEnd) != 0;
  header.channel = step.channel;
  header.ttl = step.ttl;
  Packet packet = {};
  W::encode(header, packet.data());
  const size_t last = packet.size() - W::kChecksumBytes - 1;
  std::fill(packet.begin() + W::kHeaderBytes, packet.end(),
            static_cast<uint8_t>((step.body >> 4) * 17));
  packet[last] = static_cast<uint8_t>((step.body & 15) * 17);
  W::seal(packet.data(), static_cast<W::PacketSize>(last + 1));
  if ((step.flags & Step::kDamaged) != 0) packet.back() ^= 1;
  return packet;
}

EmulatedNode::Packet EmulatedNode::echo_of(const Step& step) const {
  Packet packet = pulled_[static_cast<uint8_t>(pulls_ - 1 - step.count) % pulled_.size()];
  W::TtlField::put(packet.data(), step.ttl);
  W::seal(packet.data(), static_cast<W::PacketSize>(packet.size() - W::kChecksumBytes));
  return packet;
}

void EmulatedNode::run(const Step& step, const OnCall& on_call) {
  switch (step.kind) {
    case Step::Kind::kHear:
      return hear(packet_of(step), (step.flags & Step::kFar) != 0 ? kFar : kNear, on_call);
    case Step::Kind::kEcho:
      return hear(echo_of(step), kNear, on_call);
    case Step::Kind::kPull:
      for (uint8_t n = 0; n < step.count; ++n) pull(step.ticks, on_call);
      return;
    case Step::Kind::kSend:
      return send(step);
    case Step::Kind::kWait:
      return wait(step.ticks);
  }
}

}  // namespace swarmtalk::avr
