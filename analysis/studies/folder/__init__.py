"""The folder of a study on disk: whole parts, a manifest, a lock and a heartbeat.

`study_folder.StudyFolder` writes the parts of finished shards, says which runs are done, and reads them as tables.
Its manifest says which study the folder belongs to, and its `verify` finds damaged parts and sets them aside. `parts`
names, writes and reads one part, `lock` keeps two sweeps apart, and `progress` records what a sweep does. Nothing is
ever deleted but drafts.
"""
