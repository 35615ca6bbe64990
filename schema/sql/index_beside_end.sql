-- Ends the index of index_beside.sql, when the map has its own.
DROP TABLE temp.feature_index;
