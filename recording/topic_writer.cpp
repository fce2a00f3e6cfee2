#include "recording/topic_writer.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <set>

namespace swarmtalk::recording {
namespace {

/// The file and those that it imports, each once, those first.
void add_descriptors(const google::protobuf::FileDescriptor& file, std::set<std::string>& added,
                     google::protobuf::FileDescriptorSet& to) {
  if (!added.insert(std::string(file.name())).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) {
    add_descriptors(*file.dependency(i), added, to);
  }
  file.CopyTo(to.add_file());
}

}  // namespace

std::uint16_t TopicWriter::schema(const google::protobuf::Descriptor& descriptor) {
  const std::string name(descriptor.full_name());
  std::uint16_t& id = schemas_[name];
  if (id == 0) {
    google::protobuf::FileDescriptorSet set;
    std::set<std::string> added;
    add_descriptors(*descriptor.file(), added, set);
    id = writer_.add_schema({name, "protobuf", set.SerializeAsString()});
  }
  return id;
}

TopicWriter::Topic& TopicWriter::topic(const std::string& name, std::uint16_t schema) {
  const auto found = topics_.find(name);
  if (found != topics_.end()) return found->second;
  const std::uint16_t id = writer_.add_channel({schema, name, "protobuf", {}});
  return topics_.emplace(name, Topic{id, 0}).first->second;
}

bool TopicWriter::write(const std::string& name, const google::protobuf::Message& message,
                        std::uint64_t time_ns, std::optional<std::uint32_t> sequence) {
  Topic& to = topic(name, schema(*message.GetDescriptor()));
  message.SerializeToString(&bytes_);
  return writer_.write({to.channel, sequence.value_or(++to.sequence), time_ns, time_ns, bytes_});
}

bool TopicWriter::write_encoded(const std::string& name, const McapSchema& schema,
                                std::string_view bytes, std::uint64_t time_ns) {
  std::uint16_t& id = schemas_[schema.name];
  if (id == 0) id = writer_.add_schema(schema);
  Topic& to = topic(name, id);
  return writer_.write({to.channel, ++to.sequence, time_ns, time_ns, bytes});
}

}  // namespace swarmtalk::recording
