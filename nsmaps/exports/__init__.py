"""Maps, closed forms and exact systems as files of other languages; what is called is `nsmaps.export(result, "c")`."""
