"""The folder of a study on disk: whole parts, a manifest, a lock and a heartbeat.

`study_folder.StudyFolder` writes the parts of finished shards, says which runs are done, and reads them as tables.
Its manifest says which study the folder belongs to. `parts` names, writes and reads one part, `lock` with `file_lock`
keeps two sweeps apart, `progress` records what a sweep does, `status` reports, and `verify` finds damaged parts and
sets them aside. Nothing is ever deleted but drafts.
"""
