"""The cache of recordings and answers, and the files a campaign keeps."""
