#!/usr/bin/env python3
"""What the public Python packages `mcap` and `mcap-protobuf-support` find in a recording, as JSON.

In: a recording; the descriptors come out of the file. Out: topics with counts, first and last message, attachments, metadata.
Knows nothing of sollwert. Usage: read_python.py FILE      (pip install -r tests/readers/requirements.txt)
"""
import hashlib
import json
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory


def fields(message):
    """The fields that are present (or cannot be told from absent ones), by their names in the .proto file."""
    found = {}
    for field in message.DESCRIPTOR.fields:
        if not field.has_presence or message.HasField(field.name):
            value = getattr(message, field.name)
            if field.is_repeated:
                found[field.name] = [fields(each) if field.message_type else each for each in value]
            else:
                found[field.name] = fields(value) if field.message_type else value
    return found


def main(path):
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        topics = {}
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            topic = topics.setdefault(channel.topic, {"schema": schema.name, "messages": 0, "metadata": dict(channel.metadata)})
            topic["messages"] += 1
            seen = (message.log_time, message.sequence, decoded)
            topic.setdefault("first", seen)
            topic["last"] = seen
        for topic in topics.values():
            for end in ("first", "last"):
                log_time, sequence, decoded = topic[end]
                topic[end] = {"log_time_ns": log_time, "sequence": sequence, "fields": fields(decoded)}
        counts = {reader.get_summary().channels[id].topic: n for id, n in reader.get_summary().statistics.channel_message_counts.items()}
        metadata = {}
        for record in reader.iter_metadata():
            metadata.setdefault(record.name, {}).update(record.metadata)
        attachments = [
            {"name": a.name, "media_type": a.media_type, "bytes": len(a.data), "sha256": hashlib.sha256(a.data).hexdigest()}
            for a in reader.iter_attachments()
        ]
        return {
            "library": reader.get_header().library,
            "topics": topics,
            "counts": counts,
            "attachments": attachments,
            "metadata": metadata,
        }


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    json.dump(main(sys.argv[1]), sys.stdout, sort_keys=True)
    print()
