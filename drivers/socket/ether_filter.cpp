#include "drivers/socket/ether_filter.hpp"

#include <linux/filter.h>
#include <pcap/pcap.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

namespace swarmtalk::drivers {
namespace {

struct CompilerCloser {
  void operator()(pcap_t* handle) const { pcap_close(handle); }
};

std::vector<sock_filter> compile_ether_filter(std::uint16_t ethertype) {
  constexpr int kLongestFrameBytes = 65535;
  std::array<char, 32> expression{};
  std::snprintf(expression.data(), expression.size(), "ether proto 0x%04x", unsigned{ethertype});
  const std::unique_ptr<pcap_t, CompilerCloser> compiler(
      pcap_open_dead(DLT_EN10MB, kLongestFrameBytes));
  bpf_program program{};
  if (!compiler ||
      pcap_compile(compiler.get(), &program, expression.data(), 1, PCAP_NETMASK_UNKNOWN) != 0) {
    throw std::runtime_error(std::string("libpcap cannot compile '") + expression.data() +
                             "': " + (compiler ? pcap_geterr(compiler.get()) : "out of memory"));
  }
  // The same four fields under other names, see pcap/bpf.h and linux/filter.h.
  std::vector<sock_filter> filter;
  for (unsigned i = 0; i < program.bf_len; ++i) {
    const bpf_insn& instruction = program.bf_insns[i];
    filter.push_back({instruction.code, instruction.jt, instruction.jf, instruction.k});
  }
  pcap_freecode(&program);
  return filter;
}

}  // namespace

void attach_locked_ether_filter(int packet_socket, std::uint16_t ethertype) {
  std::vector<sock_filter> filter = compile_ether_filter(ethertype);
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  const int on = 1;
  if (setsockopt(packet_socket, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program) != 0 ||
      setsockopt(packet_socket, SOL_SOCKET, SO_LOCK_FILTER, &on, sizeof on) != 0) {
    throw std::runtime_error(std::string("cannot attach the frame filter: ") +
                             std::strerror(errno));
  }
}

}  // namespace swarmtalk::drivers
