#include "client_lib/greeting.hpp"

#include "client_lib/convert.hpp"
#include "ipc/framing.hpp"
#include "text/utf8.hpp"

namespace swarmtalk::client {
namespace {

constexpr std::size_t kNameMaxBytes = 1024;

std::string version_text(std::uint32_t major, std::uint32_t minor) {
  return std::to_string(major) + "." + std::to_string(minor);
}

}  // namespace

void fill_hello(ipc::Hello& hello, const std::string& name) {
  hello.set_major(ipc::kProtocolMajor);
  hello.set_minor(ipc::kProtocolMinor);
  hello.set_name(name);
}

Status check_name(const std::string& name) {
  if (!text::is_utf8(name)) {
    return Status(StatusCode::kBadArgument, "the name of this Client is not UTF-8 text");
  }
  if (name.empty()) {
    return Status(StatusCode::kBadArgument,
                  "the name of this Client is empty; give it the name of your program");
  }
  if (name.size() > kNameMaxBytes) {
    return Status(StatusCode::kBadArgument, "the name of this Client has more than " +
                                                std::to_string(kNameMaxBytes) + " bytes");
  }
  return Status();
}

Status check_greeting(const ipc::Envelope& envelope, const std::string& path) {
  if (envelope.has_failure()) return convert(envelope.failure());
  if (!envelope.has_hello()) return Status(StatusCode::kProtocol);
  const ipc::Hello& hello = envelope.hello();
  if (hello.major() == ipc::kProtocolMajor) return Status();
  return Status(StatusCode::kVersionMismatch,
                hello.name() + " at " + path + " speaks local protocol " +
                    version_text(hello.major(), hello.minor()) + ", this program " +
                    version_text(ipc::kProtocolMajor, ipc::kProtocolMinor) +
                    "; update the older of the two");
}

}  // namespace swarmtalk::client
