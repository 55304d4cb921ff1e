#!/usr/bin/env python3
"""Reads a recording with the Python `mcap` package and prints what it found as one line of JSON.

    pip install mcap==1.6.0 mcap-protobuf-support==0.6.0
    python read_recording.py FILE

A second implementation of the format, to check what trueline writes: the checksums of the chunks and of the
data section are verified, protobuf messages are decoded with the schema in the file alone, JSON messages
are parsed. A file that was cut off is read as far as it goes. Exit code 0 whenever the line was printed; 2 for wrong usage.
"""

import json
import struct
import sys
import zlib
from pathlib import Path

from mcap.exceptions import EndOfFile, InvalidMagic, McapError, RecordLengthLimitExceeded
from mcap.records import Attachment, Channel, Chunk, Footer, Header, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_protobuf.decoder import DecoderFactory


def empty_summary():
    """The line for a file in which nothing was found."""
    return {
        "topics": {},
        "schemas": {},
        "messages": 0,
        "first_log_time": None,
        "last_log_time": None,
        "profile": None,
        "attachments": {},
        "metadata": {},
        "chunks": 0,
        "truncated": False,
        "damage": [],
        "decode_errors": [],
    }


class Recording:
    """Collects the summary of one file, record by record."""

    def __init__(self):
        self.summary = empty_summary()
        self.schemas = {}
        self.channels = {}
        self.protobuf = DecoderFactory()
        self.finished = False

    def decode(self, channel, schema, data):
        """Decodes the message where its encoding is known here; raises if that fails."""
        if channel.message_encoding == "json":
            json.loads(data)
        elif channel.message_encoding == "protobuf":
            decoder = self.protobuf.decoder_for("protobuf", schema)
            if decoder is None:
                raise McapError("protobuf message without a protobuf schema")
            decoder(data)

    def add_message(self, message):
        """Counts and decodes one message."""
        channel = self.channels.get(message.channel_id)
        if channel is None:
            self.summary["damage"].append(f"message on unknown channel {message.channel_id}")
            return
        schema = self.schemas.get(channel.schema_id)
        topic = self.summary["topics"].setdefault(
            channel.topic,
            {"messages": 0, "decoded": 0, "schema": schema.name if schema else None, "encoding": channel.message_encoding},
        )
        topic["messages"] += 1
        self.summary["messages"] += 1
        times = [t for t in (self.summary["first_log_time"], self.summary["last_log_time"], message.log_time) if t is not None]
        self.summary["first_log_time"], self.summary["last_log_time"] = min(times), max(times)
        try:
            self.decode(channel, schema, message.data)
            topic["decoded"] += 1
        except Exception as error:  # whatever a decoder raises is the finding
            self.summary["decode_errors"].append(f"{channel.topic} {message.sequence}: {type(error).__name__}: {error}")

    def add(self, record):
        """Takes one record of the data section."""
        if isinstance(record, Header):
            self.summary["profile"] = record.profile
        elif isinstance(record, Schema):
            self.schemas[record.id] = record
            self.summary["schemas"][record.name] = record.encoding
        elif isinstance(record, Channel):
            self.channels[record.id] = record
        elif isinstance(record, Message):
            self.add_message(record)
        elif isinstance(record, Attachment):
            self.summary["attachments"][record.name] = {
                "bytes": len(record.data),
                "crc32": zlib.crc32(record.data),
                "media_type": record.media_type,
            }
        elif isinstance(record, Metadata):
            self.summary["metadata"][record.name] = record.metadata
        elif isinstance(record, Chunk):
            self.summary["chunks"] += 1
            try:
                for inner in breakup_chunk(record, validate_crc=True):
                    self.add(inner)
            except Exception as error:  # zstandard and lz4 raise classes of their own
                self.summary["damage"].append(f"chunk {self.summary['chunks']}: {type(error).__name__}: {error}")
        elif isinstance(record, Footer):
            self.finished = True


def read(path):
    """The summary of a file."""
    recording = Recording()
    summary = recording.summary
    size = path.stat().st_size
    with path.open("rb") as file:
        try:
            for record in StreamReader(file, emit_chunks=True, validate_crcs=True, record_size_limit=size).records:
                recording.add(record)
        except (EndOfFile, RecordLengthLimitExceeded, struct.error):
            # the next record ends behind the end of the file, or is a chunk of which the writer never noted the length
            summary["truncated"] = True
        except InvalidMagic as error:
            summary["truncated"] = recording.finished or size < 8
            if not summary["truncated"]:
                summary["damage"].append(f"InvalidMagic: {error}")
        except Exception as error:  # a damaged record can raise nearly anything, and nothing behind it is read
            summary["damage"].append(f"{type(error).__name__}: {error}")
    return summary


def main():
    """Prints the line."""
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 2
    print(json.dumps(read(Path(sys.argv[1])), sort_keys=True))
    return 0


if __name__ == "__main__":
    sys.exit(main())
